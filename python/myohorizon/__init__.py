# SPDX-License-Identifier: Apache-2.0
"""Joint angles, muscle activations and muscle forces from markers and EMG, by moving horizon estimation.

    import myohorizon

    results = myohorizon.run("arm.yaml")                  # a recording, as mhe-run does
    results.force["BRA"]                                  # N, a pandas Series over time (s)

    with myohorizon.Estimator("arm.yaml") as estimator:   # frame by frame, live
        estimate = estimator.push(t, markers, emg)        # None, or q, force, activation, ... as numpy arrays

    myohorizon.Model("arm.osim").evaluate(q={"elbow": 1.2})["lines"]["BRA"]["length"]

Units are SI and radians. Missing values are NaN. Errors are exceptions (myohorizon.Error) that hold the file and line they
name. Messages of the library go to the logger "myohorizon". The keys of a config: myohorizon.describe("config").
"""
from .batch import batch
from .catalogue import describe, plugins, version
from .costs import Cost
from .errors import (ArgumentError, ClosedError, ConfigError, Error, InputError, Interrupted, NumericError, OutputError,
                     PluginError, ThreadError, UnsupportedError)
from .estimate import Estimate
from .estimator import Estimator
from .live import Live
from .model import Model
from .results import Finding, Results, check_config, run
from .tables import Motion, Table, read_c3d, read_sto, read_trc, read_xdf

__version__ = version()

__all__ = ["ArgumentError", "ClosedError", "ConfigError", "Cost", "Error", "Estimate", "Estimator", "Finding", "InputError",
           "Interrupted", "Live", "Model", "Motion", "NumericError", "OutputError", "PluginError", "Results", "Table",
           "ThreadError", "UnsupportedError", "batch", "check_config", "describe", "plugins", "read_c3d", "read_sto", "read_trc",
           "read_xdf", "run", "version"]
