# SPDX-License-Identifier: Apache-2.0
"""The type stubs say what is there; every public name has a docstring."""
import ast
import inspect
import re
from pathlib import Path

from support import SOURCE

import myohorizon

STUB = Path(myohorizon.__file__).parent / "__init__.pyi"


def arguments(node):
    a = node.args
    names = [arg.arg for arg in a.posonlyargs + a.args + a.kwonlyargs]
    return names + [f"*{a.vararg.arg}"] if a.vararg else names + ([f"**{a.kwarg.arg}"] if a.kwarg else [])


def parameters(function):
    marks = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    found = [marks.get(p.kind, "") + name for name, p in inspect.signature(function).parameters.items()]
    return sorted(found, key=lambda name: name.startswith("**"))


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
