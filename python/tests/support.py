# SPDX-License-Identifier: Apache-2.0
"""The demo's data as an instrument would give them."""
import os
from pathlib import Path

import numpy as np

import myohorizon

SOURCE = Path(os.environ["MHE_SOURCE"])
BUILD = Path(os.environ["MHE_BUILD"])
ARM19 = SOURCE / "models/arm19"
DEMO = ARM19 / "demo.yaml"
FAST = {"solver.plugin": "mhe.solver.rti"}


def demo_frames(n=None):
    """(t, markers [8, 3], emg [19]) of the demo, in the order of the model."""
    with myohorizon.Estimator(DEMO) as estimator:
        marker_names, muscle_names = estimator.marker_names, estimator.muscle_names
    markers = myohorizon.read_trc(ARM19 / "demo_markers.trc")
    emg = myohorizon.read_sto(ARM19 / "demo_emg.sto")
    m = np.stack([markers[name] for name in marker_names], axis=1)
    e = np.stack([emg[name] for name in muscle_names], axis=1)
    return list(zip(markers.time.tolist(), m, e))[:n]
