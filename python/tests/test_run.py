# SPDX-License-Identifier: Apache-2.0
"""Whole recordings: what mhe-run writes, to the bit."""
import json
import subprocess

import numpy as np
import pytest
from support import BUILD, DEMO, demo_frames

import myohorizon


@pytest.fixture(scope="module")
def of_program(tmp_path_factory):
    out = tmp_path_factory.mktemp("out") / "demo"
    subprocess.run([BUILD / "bin/mhe-run", DEMO, "--out", out, "--quiet", "--set", "output.picture=false",
                    "--set", "output.formats=[mat]"], check=True,
                   capture_output=True)
    return out


@pytest.fixture(scope="module")
def results():
    return myohorizon.run(DEMO)


def rows(path):
    """Texts of a .sto's cells."""
    lines = path.read_text().splitlines()
    begin = next(k for k, line in enumerate(lines) if line.strip() == "endheader")
    return lines[begin + 1].split("\t"), [line.split("\t") for line in lines[begin + 2:]]


@pytest.mark.parametrize("name, file, prefix", [("force", "forces", ""), ("q", "estimates", "q_"), ("qdot", "estimates", "qdot_"),
                                                ("activation", "estimates", "a_"), ("excitation", "estimates", "e_"),
                                                ("moment", "torques", "moment_")])
def test_the_digits_are_those_of_mhe_run(of_program, results, name, file, prefix):
    labels, cells = rows(of_program / f"{file}.sto")
    table = results.table(name)
    assert len(cells) == len(table) > 80
    for column in table.columns:
        at = labels.index(prefix + column)
        assert [row[at] for row in cells] == ["%.12g" % value for value in table[column]], column


def test_the_bits_are_those_of_mhe_run(of_program, results):
    """results.mat holds doubles as they are; a push a frame gives the same."""
    scipy_io = pytest.importorskip("scipy.io", reason="python3-scipy reads what mhe-run writes for MATLAB")
    written = scipy_io.loadmat(of_program / "results.mat", simplify_cells=True)
    states = np.hstack([results.table(name).values for name in ("q", "qdot", "activation", "excitation")])
    for table, values in (("estimates", states), ("forces", results.table("force").values)):
        assert written[table]["data"].tobytes() == values.tobytes() and len(values) > 80, table
    assert written["forces"]["time"].tobytes() == results.table("force").time.tobytes()
    with myohorizon.Estimator(DEMO) as estimator:
        pushed = [e for e in (estimator.push(*frame) for frame in demo_frames()) if e is not None]
    assert np.array([e.force for e in pushed]).tobytes() == results.table("force").values.tobytes()


def test_markers_and_quality(of_program, results):
    written = myohorizon.read_trc(of_program / "markers.trc")
    assert written.labels == results.table("markers").labels
    assert np.abs(written.values - results.table("markers").values).max() < 1e-11  # of 12 digits, in mm there
    labels, cells = rows(of_program / "quality.sto")
    assert [int(row[1]) for row in cells] == results.table("quality")["status"].astype(int).tolist()


def test_errors_and_verdict(of_program, results):
    summary = json.loads((of_program / "summary.json").read_text())
    assert results.verdict == summary["verdict"]["usable"]
    assert results.rmse["force"] == pytest.approx(summary["rmse"]["force_n"], rel=1e-6)
    assert "EMG and estimate are" in results.text
    assert "window: 7" in results.config and results.name == "demo"


def test_data_frames(results):
    pandas = pytest.importorskip("pandas")
    assert isinstance(results.force, pandas.DataFrame)
    assert results.force.index.name == "time" and list(results.force.columns) == list(results.table("force").columns)
    assert results.force["BRA"].max() > 1 and results.markers.shape[1] == 24
    assert results.force is results.force
    with pytest.raises(AttributeError, match="they have q, qdot"):
        results.forces


def test_data_set(results):
    pytest.importorskip("xarray")
    dataset = results.xarray()
    assert dataset.force.sel(muscle="BRA").shape == (len(results.time),)
    assert dataset.markers.dims == ("time", "marker", "axis") and dataset.force.attrs["unit"] == "N"


def test_progress_and_its_end():
    seen = []

    def progress(done, of):
        seen.append((done, of))
        if done == 50:
            raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        myohorizon.run(DEMO, progress=progress, solver__plugin="mhe.solver.rti")
    assert seen[-1] == (50, 301)


def test_check_before_running():
    verdict, findings = myohorizon.check_config(DEMO)
    assert verdict == "yes" and findings == []
    verdict, findings = myohorizon.check_config(DEMO, data__transform={"rotate": "x-90"})
    assert verdict != "yes"
    assert findings[0].weight in ("doubtful", "useless") and findings[0].text and findings[0].remedy


def test_what_cannot_run(tmp_path):
    with pytest.raises(myohorizon.Error):
        myohorizon.run(DEMO, data__markers="none.trc")
    empty = tmp_path / "empty.yaml"
    empty.write_text("")
    with pytest.raises(myohorizon.Error):
        myohorizon.run(empty)
