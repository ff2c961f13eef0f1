# SPDX-License-Identifier: Apache-2.0
"""Sessions from Python."""
import pytest
from support import ARM19, DEMO

import myohorizon


def test_a_session(tmp_path):
    trials = {"all": {"data.markers": ARM19 / "demo_markers.trc"}, "short": {"horizon.window": 5},
              "gone": {"data.markers": "none.trc"}}
    rows = myohorizon.batch(DEMO, trials, tmp_path / "out", workers=2, progress=False, solver__plugin="mhe.solver.rti",
                            output__picture=False)
    by_name = {row["trial"]: row for row in rows}
    assert list(by_name) == ["all", "short", "gone"]
    assert by_name["all"]["usable"] == "yes" and by_name["all"]["estimates"] == 94 and by_name["all"]["rmse_force_n"] < 5
    assert by_name["short"]["estimates"] > 94
    assert by_name["gone"]["usable"] == "failed" and by_name["gone"]["exit_status"] == 2
    assert "none.trc" in by_name["gone"]["reason"] and by_name["gone"]["rmse_force_n"] is None
    assert (tmp_path / "out/all/report.html").exists()
    alone = myohorizon.run(DEMO, solver__plugin="mhe.solver.rti", horizon__window=5)
    written = myohorizon.read_sto(tmp_path / "out/short/forces.sto")
    assert ["%.12g" % x for x in written["BRA"]] == ["%.12g" % x for x in alone.table("force")["BRA"]]


def test_what_is_wrong(tmp_path):
    with pytest.raises(myohorizon.InputError, match="windw.*did you mean 'window'"):
        myohorizon.batch(DEMO, {"a": {"horizon.windw": 3}}, tmp_path / "out", progress=False)
    with pytest.raises(myohorizon.InputError, match="none.csv"):
        myohorizon.batch(DEMO, tmp_path / "none.csv", tmp_path / "out", progress=False)
