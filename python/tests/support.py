# SPDX-License-Identifier: Apache-2.0
"""The demo's data as an instrument would give them."""
import functools
import os
from pathlib import Path

import numpy as np

import myohorizon

SOURCE = Path(os.environ["MHE_SOURCE"])
BUILD = Path(os.environ["MHE_BUILD"])
ARM19 = SOURCE / "models/arm19"
DEMO = ARM19 / "demo.yaml"
FAST = {"solver.plugin": "mhe.solver.rti"}


@functools.cache
def _frames():
    with myohorizon.Estimator(DEMO) as estimator:
        marker_names, muscle_names = estimator.marker_names, estimator.muscle_names
    markers = myohorizon.read_trc(ARM19 / "demo_markers.trc")
    emg = myohorizon.read_sto(ARM19 / "demo_emg.sto")
    m = np.stack([markers[name] for name in marker_names], axis=1)
    e = np.stack([emg[name] for name in muscle_names], axis=1)
    m.flags.writeable = e.flags.writeable = False  # tests share them; the library writes to no argument
    return list(zip(markers.time.tolist(), m, e))


def demo_frames(n=None):
    """(t, markers [8, 3], emg [19]) of the demo, in the order of the model."""
    return _frames()[:n]


def short_demo(folder, n):
    """The files of the demo's first n frames, as keys of the config: for what need not be long."""
    keys = {}
    for key, name, header in (("data.markers", "demo_markers.trc", 6), ("data.emg", "demo_emg.sto", None)):
        lines = (ARM19 / name).read_text().splitlines(keepends=True)
        header = header or lines.index("endheader\n") + 2
        (folder / name).write_text("".join(lines[:header]).replace("301", str(n)) + "".join(lines[header:header + n]))
        keys[key] = folder / name
    return keys
