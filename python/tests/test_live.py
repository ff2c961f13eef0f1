# SPDX-License-Identifier: Apache-2.0
"""Streams from Python: what mhe-live does. Devices and sinks have tests of their own (tests/live)."""
import subprocess
import sys
import threading

import pytest
from support import ARM19

import myohorizon

STREAM = {"config": ARM19 / "live.yaml", "sinks": [], "sources.0.speed": 0,  # the demo, as fast as it is taken
          "realtime.deadline_ms": 0}

FOR_EVER = {"sources.0.speed": 1}  # by the clock, round and round


def stream(**keys):
    return myohorizon.Live(**{**STREAM, **keys})


def test_a_run_its_recording_and_the_recording_run_again(tmp_path):
    with stream(folder=tmp_path, record=tmp_path / "session.xdf") as live:
        live.run(0.5)
        told = live.summary()
        assert [s["name"].split("/")[-1] for s in live.state()["streams"]] == ["demo_markers.trc", "demo_emg.sto"]
    assert told["estimates"] == told["frames"] - 7 > 40 and told["by_status"]["converged"] > 0
    assert {s["found"] for s in told["streams"]} == {8, 19} and told["streams"][0]["missing"] == []
    markers, signals = myohorizon.read_xdf(tmp_path / "session.xdf")
    assert len(markers.labels) == 8 and len(signals.columns) == 19 and len(markers) > 50
    again = {"sources": [{"plugin": "mhe.source.recording", "file": str(tmp_path / "session.xdf"), "speed": 0}]}
    with myohorizon.Live(ARM19 / "live.yaml", folder=tmp_path, **again, sinks=[]) as live:
        live.run()
        assert live.summary()["estimates"] == told["estimates"]
    with pytest.raises(myohorizon.OutputError, match="session.xdf"):
        stream(record=tmp_path / "session.xdf").run(0.1)


def test_stopped_by_another_thread_and_by_a_command():
    for end in (lambda live: live.stop(), lambda live: live.command("stop")):
        with stream(**FOR_EVER) as live:
            other = threading.Timer(0.1, end, [live])
            other.start()
            live.run()
            other.join()
            assert live.summary()["frames"] < 1e6


def test_ctrl_c_ends_it():
    code = f"""
import os, signal, threading, myohorizon
live = myohorizon.Live({str(STREAM["config"])!r}, sinks=[], **{FOR_EVER!r})
threading.Timer(0.2, os.kill, [os.getpid(), signal.SIGINT]).start()
try:
    live.run()
except KeyboardInterrupt:
    print("ended", live.summary()["out_of_order"])
live.close()
"""
    done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True)
    assert done.stdout == "ended 0\n" and done.returncode == 0, done.stderr


def test_what_is_wrong(tmp_path):
    with pytest.raises(myohorizon.ConfigError, match="sources"):
        myohorizon.Live(ARM19 / "demo.yaml")
    with pytest.raises(myohorizon.Error, match="mhe.source.none"):
        stream(**{"sources": [{"plugin": "mhe.source.none"}]})
    with pytest.raises(myohorizon.Error, match="none.trc"):
        stream(**{"sources.0.markers": "none.trc"})
    with stream() as live:
        with pytest.raises(myohorizon.ArgumentError, match="dance"):
            live.command("dance")
        with pytest.raises(ValueError, match="NUL"):
            live.command("a\0b")
    live.close()
    for use in (live.run, live.summary, live.state, lambda: live.command("stop")):
        with pytest.raises(myohorizon.ClosedError):
            use()
    live.stop()  # nothing to stop
