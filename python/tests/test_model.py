# SPDX-License-Identifier: Apache-2.0
"""Models: what mhe-model tells."""
import json
import subprocess

import numpy as np
import pytest
from support import BUILD, SOURCE

import myohorizon

ARM26 = SOURCE / "models/arm26/arm26.osim"


def test_what_is_in_it():
    model = myohorizon.Model(ARM26)
    assert model.coordinate_names == ("r_shoulder_elev", "r_elbow_flex")
    assert "BRA" in model.muscle_names and len(model.marker_names) == 3 and "r_humerus" in model.body_names
    assert model.mass == pytest.approx(3.398887) and model.info["unsupported"] == []


def test_the_same_as_the_program(tmp_path):
    poses = {"poses": [{"q": {"r_elbow_flex": 1.2}, "activation": 0.5, "u": {"r_elbow_flex": -1.0}}]}
    (tmp_path / "poses.json").write_text(json.dumps(poses))
    done = subprocess.run([BUILD / "bin/mhe-model", "evaluate", ARM26, "--poses", tmp_path / "poses.json"], check=True,
                          capture_output=True, text=True)
    model = myohorizon.Model(ARM26)
    assert model.evaluate_all(poses["poses"]) == json.loads(done.stdout)["poses"]
    assert model.evaluate(q={"r_elbow_flex": 1.2}, u={"r_elbow_flex": -1.0}, activation=0.5) == \
        json.loads(done.stdout)["poses"][0]


def test_a_moment_arm_is_a_derivative():
    model = myohorizon.Model(ARM26)
    angles = np.array([1.2 - 1e-5, 1.2, 1.2 + 1e-5])
    poses = model.evaluate_all([{"q": {"r_elbow_flex": angle}} for angle in angles])
    lengths = [pose["lines"]["BRA"]["length"] for pose in poses]
    arm = poses[1]["lines"]["BRA"]["moment_arm"]["r_elbow_flex"]
    assert arm == pytest.approx(-(lengths[2] - lengths[0]) / 2e-5, abs=1e-7)


def test_what_is_wrong(tmp_path):
    with pytest.raises(myohorizon.InputError):
        myohorizon.Model(tmp_path / "none.osim")
    (tmp_path / "bad.osim").write_text("<OpenSimDocument>")
    with pytest.raises(myohorizon.InputError, match="bad.osim"):
        myohorizon.Model(tmp_path / "bad.osim")
    model = myohorizon.Model(ARM26)
    with pytest.raises(myohorizon.InputError, match="r_elbow_flex|elbow"):
        model.evaluate(q={"elbow": 1})
    with pytest.raises(ValueError, match="'exact' or 'fitted'"):
        model.evaluate(paths="straight")
    with pytest.raises(ValueError):
        model.evaluate(q={"r_elbow_flex": float("nan")})
    with pytest.raises((TypeError, myohorizon.InputError)):
        model.evaluate(q={"r_elbow_flex": "much"})


def test_the_catalogue():
    ids = json.dumps(myohorizon.plugins())
    assert "mhe.solver.rti" in ids and "mhe.cost.callback" in ids
    assert "horizon" in json.dumps(myohorizon.describe())
    with pytest.raises(myohorizon.PluginError, match="mhe.solver.rti"):
        myohorizon.describe("mhe.solver.rtj")
    assert myohorizon.__version__.count(".") == 2
