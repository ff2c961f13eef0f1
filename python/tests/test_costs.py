# SPDX-License-Identifier: Apache-2.0
"""Costs in Python: the same as in C, and their exceptions come out."""
import os
import subprocess

import numpy as np
import pytest
from support import BUILD, DEMO, FAST, SOURCE

import myohorizon
from myohorizon import Cost

TRACK = {"plugin": "mhe.cost.emg-markers-high"}


def run(cost, **keys):
    return myohorizon.run(DEMO, functions={"mine": cost}, **FAST,
                          costs=[TRACK, {"plugin": "mhe.cost.callback", "function": "mine", **keys}])


def test_the_bits_are_those_of_the_example_in_c(tmp_path):
    """examples/cost_effort, compiled, and the same in Python."""
    flags = ["-fsanitize=" + os.environ["MHE_SANITIZE"]] if os.environ.get("MHE_SANITIZE") else []
    subprocess.run([os.environ["MHE_C_COMPILER"], "-std=c11", "-fPIC", "-shared", "-fvisibility=hidden", *flags,
                    f"-I{SOURCE}/core/include", f"-I{BUILD}/core/include", str(SOURCE / "examples/cost_effort/cost_effort.c"),
                    "-o", str(tmp_path / "effort.so")], check=True)
    of_c = myohorizon.run(DEMO, **FAST, plugin_path=[str(tmp_path)],
                          costs=[TRACK, {"plugin": "org.example.cost.effort", "rest": 0.05, "weight": 100}])
    exact = run(Cost("activation", lambda y, target: y - 0.05, lambda y, target: np.eye(len(y))), weight=100)
    differenced = run(Cost("activation", lambda y, target: y - 0.05), weight=100)
    plain = myohorizon.run(DEMO, **FAST, costs=[TRACK])
    forces = exact.table("force").values
    assert np.abs(forces - plain.table("force").values).max() > 10
    # A dense and a diagonal sum differ in the last bit, and what the window that begins goes by is not the same: its start,
    # which hardly anything measures, is another within the tolerance, and is forgotten after a second.
    assert np.abs(forces - of_c.table("force").values)[30:].max() < 1e-9
    assert np.abs(forces - differenced.table("force").values).max() < 1e-3


def test_several_signals_and_the_node_before():
    seen = set()

    def residual(y, target):
        seen.add(len(y))
        return (y[:4] - y[4:]) / 0.03
    results = run(Cost(["qdot", ("qdot", "previous")], residual, n_res=4), weight=1e-4)
    assert seen == {8} and results.verdict in ("yes", "doubtful")


@pytest.mark.parametrize("residual, cause", [
    (lambda y, target: 1 / 0, ZeroDivisionError),
    (lambda y, target: y[:3], ValueError),
    (lambda y, target: "text", ValueError),
    (lambda y, target: None, Exception),
])
def test_what_a_cost_raises_ends_the_run(residual, cause):
    with pytest.raises(myohorizon.NumericError, match="a cost in Python") as caught:
        run(Cost("activation", residual))
    assert isinstance(caught.value.__cause__, cause)


def test_a_jacobian_of_another_shape():
    with pytest.raises(myohorizon.NumericError, match=r"jacobian\(\) gave \[3, 3\], not \[19, 19\]"):
        run(Cost("activation", lambda y, target: y, lambda y, target: np.eye(3)))


def test_names_that_there_are_none_of():
    with pytest.raises(myohorizon.Error, match="the problem has no signal 'forces'"):
        run(Cost("forces", lambda y, target: y))
    with pytest.raises(myohorizon.ConfigError, match="brings no cost 'yours'"):
        run(Cost("q", lambda y, target: y), function="yours")
    with pytest.raises(myohorizon.ConfigError, match="brings no cost 'mine'"):
        myohorizon.run(DEMO, costs=[TRACK, {"plugin": "mhe.cost.callback", "function": "mine"}])
    with pytest.raises(TypeError, match="is no myohorizon.Cost"):
        myohorizon.run(DEMO, functions={"mine": lambda y, target: y})
    with pytest.raises(ValueError, match="'node', 'previous' or 'first'"):
        Cost([("q", "next")], lambda y, target: y)
    with pytest.raises(TypeError, match="functions of"):
        Cost("q", 3)


def test_ctrl_c_in_a_cost_ends_the_run():
    def interrupted(y, target):
        raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        run(Cost("q", interrupted))


def test_several_threads_call_it():
    one = run(Cost("activation", lambda y, target: y - 0.05))
    four = myohorizon.run(DEMO, functions={"mine": Cost("activation", lambda y, target: y - 0.05)}, **FAST,
                          realtime__threads=4,
                          costs=[TRACK, {"plugin": "mhe.cost.callback", "function": "mine"}])
    assert np.array_equal(one.table("force").values, four.table("force").values)
