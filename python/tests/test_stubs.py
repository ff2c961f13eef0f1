# SPDX-License-Identifier: Apache-2.0
"""The type stubs say what is there; every public name has a docstring."""
import ast
import inspect
import re
from pathlib import Path

from support import DEMO, FAST, SOURCE

import myohorizon

STUB = Path(myohorizon.__file__).parent / "__init__.pyi"


def arguments(node):
    """Of a stub: what `parameters` says of the code, {name: (kind, default)}."""
    a = node.args
    kinds = inspect.Parameter
    plain = a.posonlyargs + a.args
    found = {arg.arg: (kinds.POSITIONAL_OR_KEYWORD, None) for arg in plain}
    found.update((arg.arg, (kinds.POSITIONAL_OR_KEYWORD, ast.literal_eval(value)))
                 for arg, value in zip(plain[len(plain) - len(a.defaults):], a.defaults))
    found.update((arg.arg, (kinds.KEYWORD_ONLY, ast.literal_eval(value) if value is not None else None))
                 for arg, value in zip(a.kwonlyargs, a.kw_defaults))
    if a.vararg:
        found[a.vararg.arg] = (kinds.VAR_POSITIONAL, None)
    if a.kwarg:
        found[a.kwarg.arg] = (kinds.VAR_KEYWORD, None)
    return found


def parameters(function):
    return {name: (p.kind, None if p.default is p.empty else p.default)
            for name, p in inspect.signature(function).parameters.items()}


def fields(node):
    return {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}


def documented(real):
    """Names of a docstring's table and of its Attributes."""
    doc = inspect.getdoc(real)
    told = re.findall(r"^``(\w+)``", doc, re.M) + re.findall(r"``(\w+)`` ?(?:\(|and|,|of|\.|$)", doc)
    attributes = doc.partition("Attributes:\n")[2].split("\n\n")[0]
    for names in re.findall(r"^ {4}([\w, ]+):", attributes, re.M):
        told += names.split(", ")
    return set(told)


def test_the_fields_of_the_stubs_are_those_of_the_code():
    classes = {node.name: node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef)}
    quantities = set(myohorizon.Estimate.units)
    slots = {name for name in myohorizon.Estimate.__slots__ if not name.startswith("_")}
    assert fields(classes["Estimate"]) == quantities | slots | {"units"}
    results = myohorizon.run(DEMO, **FAST)
    with_residuals = {*results._tables, "residual"}
    assert fields(classes["Results"]) == with_residuals | {name for name in vars(results) if not name.startswith("_")}
    assert fields(classes["Table"]) == set(vars(results.table("q")))
    for name, node in classes.items():  # the docstring names each of them, and nothing else
        if name in ("Estimate", "Table", "Results", "Error", "Calibration"):
            told = documented(getattr(myohorizon, name))
            wanted = fields(node) - {"units"} - (quantities | {"name"} if name == "Results" else {"name"} if name == "Table" else
                                                 {"q_sd", "activation_sd", "force_sd", "moment_sd"} if name == "Estimate" else set())
            assert wanted - {"quality"} <= told, f"{name}: {wanted - told} are not explained"


def test_the_stubs_are_those_of_the_code():
    tree = ast.parse(STUB.read_text())
    stubbed = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert set(stubbed) == set(myohorizon.__all__)
    for name, node in stubbed.items():
        real = getattr(myohorizon, name)
        if isinstance(node, ast.FunctionDef):
            assert arguments(node) == parameters(real), name
            continue
        members = {m.name: m for m in node.body if isinstance(m, ast.FunctionDef)}
        for member, m in members.items():
            has = inspect.getattr_static(real, member)
            is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in m.decorator_list)
            assert isinstance(has, property) == is_property, f"{name}.{member}"
            if not is_property and not (member.startswith("__") and member != "__init__"):
                assert arguments(m) == parameters(has), f"{name}.{member}"
        written = {m for m in vars(real) if not m.startswith("_") and callable(getattr(real, m))}
        assert written <= set(members) | {"count", "index"}, f"{name}: {written - set(members)}"


def test_everything_public_is_explained():
    for name in myohorizon.__all__:
        real = getattr(myohorizon, name)
        assert real.__doc__, name
        if inspect.isclass(real):
            for member, value in vars(real).items():
                if not member.startswith("_") and inspect.isfunction(value) and real.__module__.startswith("myohorizon"):
                    assert value.__doc__ or member in ("close", "table", "xarray", "labels"), f"{name}.{member}"


def test_octave_and_matlab_have_the_same_shape():
    """Each function is a file, each method one of the class's or, what only tells, a field of info()."""
    package = SOURCE / "matlab/+myohorizon"
    told = set(re.findall(r'"(\w+)", ', (SOURCE / "matlab/gateway_estimator.c").read_text() + (SOURCE / "matlab/gateway_values.c").read_text()))
    in_python_alone = {"Cost", "stop"}  # costs are called back; another thread stops
    for name in set(myohorizon.__all__) - in_python_alone:
        real = getattr(myohorizon, name)
        if inspect.isfunction(real):
            assert (package / f"{name}.m").exists(), name
        elif name in ("Estimator", "Live", "Model"):
            text = (package / f"{name}.m").read_text()
            has = set(re.findall(r"function (?:\w+ = )?(\w+)\(self", text)) | set(re.findall(r"^ {8}(\w+)(?: %.*)?$", text, re.M)) | told
            wanted = {member for member in vars(real) if not member.startswith("_")} - in_python_alone
            assert wanted <= has, f"{name}: {wanted - has}"
