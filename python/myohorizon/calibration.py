# SPDX-License-Identifier: Apache-2.0
"""A person's numbers from recordings: mhe-calibrate."""
import csv
import json
import os
from dataclasses import dataclass
from typing import Any

from . import _programs


@dataclass(frozen=True)
class Calibration:
    """What mhe-calibrate found (docs/calibrate.md).

    Attributes:
        outcome: "converged", or why not.
        parameters: a dict each: parameter, before, after, sd, prior_sd, lower, upper (numbers of the parameter's own unit;
            factors are 1), verdict ("informed", "not informed", "at bound", "no deviation").
        recordings: a dict each: name, held_out, before and after, each with marker_rms_mm, emg_rms (1), and q_deg, force_n,
            activation where the truth is known (else None).
        model: path of calibrated.osim.
        config: path of calibrated.yaml, for run() and Estimator.
    """
    outcome: str
    parameters: list[dict[str, Any]]
    recordings: list[dict[str, Any]]
    model: str
    config: str


def calibrate(config, out, **keys):
    """Estimates strengths, lengths, EMG gains and marker places of a person from recordings, as mhe-calibrate does.

    Args:
        config: path of a config of mhe-run with the section `calibrate`.
        out: folder of the results: calibrated.osim, calibrated.yaml, parameters.csv, calibration.json, report.html.
        **keys: assignments to the config.

    Returns a Calibration; one that has not converged says so in `outcome`. Raises InputError where the config or a recording
    is wrong. It takes seconds to minutes, in a process of its own.
    """
    out = os.fspath(out)
    status, message, _ = _programs.run("mhe-calibrate", [os.fspath(config), "--out", out, "--quiet"], keys)
    if status != 0:
        raise _programs.failed("mhe-calibrate", status, message)
    with open(os.path.join(out, "calibration.json"), encoding="utf-8") as file:
        told = json.load(file)
    with open(os.path.join(out, "parameters.csv"), encoding="utf-8", newline="") as file:
        parameters = [_row(row) for row in csv.DictReader(file)]
    return Calibration(told["outcome"], parameters, told["recordings"], os.path.join(out, "calibrated.osim"),
                       os.path.join(out, "calibrated.yaml"))


def _row(row):
    return {key: value if key in ("parameter", "verdict") else float(value) if value else None for key, value in row.items()}
