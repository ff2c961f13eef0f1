# SPDX-License-Identifier: Apache-2.0
"""Files as tables."""
import shutil

import numpy as np
import pytest
from support import ARM19, SOURCE

import myohorizon
from myohorizon import InputError


def test_markers_are_in_metres():
    table = myohorizon.read_trc(ARM19 / "demo_markers.trc")
    assert table.unit == "m" and len(table.labels) == 8 and table["DELT"].shape == (301, 3)
    assert np.abs(table.values).max() < 2 and table.rate == 100
    assert np.array_equal(table["DELT.y"], table["DELT"][:, 1])
    assert "DELT" in table and "DELT.x" in table and "NONE" not in table
    with pytest.raises(KeyError, match="it has DELT"):
        table["NONE"]


def test_signals():
    table = myohorizon.read_sto(ARM19 / "demo_emg.sto")
    assert len(table) == 301 and len(table.columns) == 19 and not table.in_degrees


def test_c3d_and_xdf():
    markers, signals = myohorizon.read_c3d(ARM19 / "demo_recording.c3d")
    assert len(markers.labels) == 8 and len(signals.columns) == 9
    assert signals.rate == pytest.approx(2000)
    markers, signals = myohorizon.read_xdf(SOURCE / "tests/fuzz/corpus/xdf/two_streams.xdf")
    assert len(markers or signals) > 0


def test_frames_of_others():
    pandas = pytest.importorskip("pandas")
    frame = myohorizon.read_sto(ARM19 / "demo_emg.sto").pandas()
    assert isinstance(frame, pandas.DataFrame) and frame.index.name == "time"
    pytest.importorskip("xarray")
    array = myohorizon.read_trc(ARM19 / "demo_markers.trc").xarray()
    assert array.sel(marker="DELT", axis="x").shape == (301,)


@pytest.mark.parametrize("read", [myohorizon.read_trc, myohorizon.read_sto, myohorizon.read_c3d, myohorizon.read_xdf])
def test_files_that_are_none(read, tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path / "none.dat")
    assert caught.value.file == str(tmp_path / "none.dat")
    for name, content in (("empty", b""), ("zeros", bytes(5000)), ("noise", bytes(range(256)) * 20)):
        for extension in ("trc", "sto", "c3d", "xdf"):
            path = tmp_path / f"{name}.{extension}"
            path.write_bytes(content)
            with pytest.raises(InputError):
                read(path)
    with pytest.raises(InputError):
        read(tmp_path)
    with pytest.raises(TypeError):
        read(None)
    with pytest.raises(ValueError):
        read("a\0b")


def test_a_line_is_named(tmp_path):
    path = tmp_path / "bad.sto"
    text = (ARM19 / "demo_emg.sto").read_text().splitlines()
    text[20] = text[20].replace("\t", "\tnonsense\t", 1)
    path.write_text("\n".join(text) + "\n")
    with pytest.raises(InputError) as caught:
        myohorizon.read_sto(path)
    assert caught.value.file == str(path) and caught.value.line == 21
    shutil.rmtree(tmp_path)
