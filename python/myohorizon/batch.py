# SPDX-License-Identifier: Apache-2.0
"""A session's trials over the processors: mhe-run --batch."""
import csv
import os
import sys

from . import _programs
from ._config import as_text


def batch(config, trials, out, *, workers=None, progress=True, **keys):
    """Runs the trials of a session over the processors, as mhe-run --batch does, and goes on where it was.

    Args:
        config: path of the shared config; None where the trials name theirs.
        trials: {name: {key: value}}, values of keys of the config; or the path of a table or folder (docs/batch.md).
            Paths in a dict start at the working directory.
        out: folder of the results: a folder a trial, batch.csv, batch.html.
        workers: processes; None: as many as processors.
        progress: show mhe-run's bar on a terminal.
        **keys: assignments for all trials.

    Returns a list of dicts, a trial each: trial, usable ("yes", "doubtful", "no", "failed"), exit_status, estimates,
    converged, solve_ms, marker_rms_mm, emg_rms, rmse_q_deg, rmse_force_n (None where there is none), reason. A trial that
    fails is no exception; what is wrong with the list or its configs is one (InputError).
    """
    out = os.fspath(out)
    if not isinstance(trials, (str, os.PathLike)):
        os.makedirs(out, exist_ok=True)
        trials = _write_list(trials, os.path.join(out, "trials.csv"))
    words = [*([os.fspath(config)] if config is not None else []), "--batch", os.fspath(trials), "--out", out]
    if workers is not None:
        words += ["--workers", str(workers)]
    if not progress:
        words.append("--quiet")
    status, message, said = _programs.run("mhe-run", words, keys)
    table = os.path.join(out, "batch.csv")
    if not os.path.exists(table) or "interrupted" in message:
        raise _programs.failed("mhe-run", status, message)
    if message and status == 0:
        print(said, end="", file=sys.stderr)
    with open(table, encoding="utf-8", newline="") as file:
        return [_row(row) for row in csv.DictReader(file)]


def _write_list(trials, path):
    keys = list(dict.fromkeys(key for trial in trials.values() for key in trial))
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["name", *keys])
        for name, trial in trials.items():
            writer.writerow([name, *(_cell(trial[key]) if key in trial else "" for key in keys)])
    return path


def _cell(value):
    text = as_text(value)
    return os.path.abspath(text) if isinstance(value, os.PathLike) or os.path.exists(text) else text


def _row(row):
    texts = ("trial", "usable", "reason")
    return {key: value if key in texts else float(value) if value else None for key, value in row.items()}
