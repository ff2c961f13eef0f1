# SPDX-License-Identifier: Apache-2.0
"""A person's numbers from Python. Whether they are right is mhe-calibrate's own test (apps_calibrate)."""
import pytest
from support import ARM19

import myohorizon

CONFIG = """model: {file: arm19.osim}
muscle: {curves: degroote2016}
horizon: {window: 7, ratio: 3}
bounds: {residual_torques: true}
costs: [{plugin: mhe.cost.emg-markers, markers: 0.001, emg_spread: 0.1, residual_torque: 0.1}]
calibrate:
  recordings:
    - {markers: demo_markers.trc, emg: weak.sto}
  parameters:
    - {name: emg_gain, muscles: [BRA]}
"""


@pytest.fixture
def person(tmp_path):
    """The demo's data, with the EMG of one muscle too small by a quarter."""
    for name in ("arm19.osim", "demo_markers.trc"):
        (tmp_path / name).write_bytes((ARM19 / name).read_bytes())
    lines = (ARM19 / "demo_emg.sto").read_text().splitlines()
    begin = next(k for k, line in enumerate(lines) if line.strip() == "endheader") + 1
    at = lines[begin].split("\t").index("BRA") if "BRA" in lines[begin].split("\t") else lines[begin].split("\t").index("e_BRA")
    for k in range(begin + 1, len(lines)):
        cells = lines[k].split("\t")
        cells[at] = repr(0.75 * float(cells[at]))
        lines[k] = "\t".join(cells)
    (tmp_path / "weak.sto").write_text("\n".join(lines) + "\n")
    path = tmp_path / "person.yaml"
    path.write_text(CONFIG)
    return path


def test_a_person(person, tmp_path):
    found = myohorizon.calibrate(person, tmp_path / "out")
    assert found.outcome == "converged"
    row, = found.parameters
    assert row["parameter"] == "emg_gain of BRA" and row["before"] == 1
    assert row["verdict"] in ("informed", "not informed", "at bound")
    assert row["lower"] <= row["after"] <= row["upper"] and row["after"] != 1 and 0 <= row["sd"] <= row["prior_sd"]
    assert [r["held_out"] for r in found.recordings] == [False]
    verdict, _ = myohorizon.check_config(found.config)
    assert verdict in ("yes", "doubtful")
    assert myohorizon.Model(found.model).muscle_names


def test_what_is_wrong(person, tmp_path):
    with pytest.raises(myohorizon.InputError, match="emg_gian.*emg_gain") as caught:
        myohorizon.calibrate(person, tmp_path / "out", **{"calibrate.parameters": [{"name": "emg_gian"}]})
    assert "calibrate" in str(caught.value) or caught.value.file
    person.write_text(CONFIG.split("calibrate:")[0])
    with pytest.raises(myohorizon.InputError, match="calibrate") as caught:
        myohorizon.calibrate(person, tmp_path / "out")
    assert caught.value.file == str(person)
