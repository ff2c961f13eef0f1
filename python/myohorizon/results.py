# SPDX-License-Identifier: Apache-2.0
"""A whole recording, estimated as mhe-run does."""
from typing import NamedTuple

import numpy as np

from ._config import Config
from ._library import check, ffi, lib, new_error, taken_text, text
from .errors import InputError
from .estimate import UNITS
from .estimator import Estimator
from .tables import Table

VERDICT = ("yes", "doubtful", "no")
WEIGHT = ("note", "doubtful", "useless")
RMSE_UNITS = {"q": "rad", "qdot": "rad/s", "activation": "1", "excitation": "1", "force": "N", "marker": "m"}
QUALITY = ("status", "iterations", "kkt_residual", "solve_time", "marker_rms", "emg_rms")


class Finding(NamedTuple):
    """What deserves a look: weight "note", "doubtful" or "useless"; the text; what helps ("": nothing is known)."""

    weight: str
    text: str
    remedy: str


class Results:
    """What run() found.

    `q`, `qdot`, `activation`, `excitation`, `force`, `moment`, `residual`, `markers`, `reactions` and `quality` are DataFrames of
    pandas, one row an estimate, indexed by time (s); `table(name)` gives the same as a Table without pandas, `xarray()`
    all of them as a Dataset. Units: rad (m), rad/s (m/s), 1, 1, N, N m (N), N m (N), m, N and N m. Columns of `quality`: status
    (0 ok, 1 iteration limit, 2 deadline, 3 predicted, 4 restarted), iterations, kkt_residual, solve_time (s),
    marker_rms (m), emg_rms.

    Attributes:
        verdict: "yes", "doubtful" or "no": can the estimates be used?
        findings: a list of Finding, why not.
        text: the findings as mhe-run prints them.
        rmse: {quantity: root mean square error} against data.reference in SI units; {} without a reference.
        name, config: of the run; the configuration with every default, YAML.
        dropped: what of the model file was left out.
    """

    def __init__(self, tables, **rest):
        self._tables = tables
        self.__dict__.update(rest)

    def table(self, name):
        if name not in self._tables:
            raise KeyError(f"the results have no '{name}'; they have {', '.join(self._tables)}")
        return self._tables[name]

    def __getattr__(self, name):
        tables = self.__dict__.get("_tables", {})
        if name not in tables:
            raise AttributeError(f"the results have no '{name}'; they have {', '.join(tables)}")
        frame = self.__dict__[name] = tables[name].pandas()
        return frame

    def __dir__(self):
        return sorted({*super().__dir__(), *self._tables})

    @property
    def time(self):
        return self._tables["quality"].time

    def xarray(self):
        import xarray
        arrays = {}
        for name, table in self._tables.items():
            of = {"q": "coordinate", "qdot": "coordinate", "moment": "coordinate", "residual": "residual_torque", "reactions": "component",
                  "quality": "number"}.get(name, "muscle")
            array = table.xarray()
            arrays[name] = array if table.is_markers else array.rename(column=of)
        return xarray.Dataset(arrays)

    def __repr__(self):
        return f"<Results of {self.name}: {len(self.time)} estimates, usable: {self.verdict}>"


class _Rows:
    """Estimates, one below the other."""

    def __init__(self, shape, n):
        self.numbers = np.empty((n, shape.size))
        self.quality = np.empty((n, len(QUALITY)))
        self.time = np.empty(n)
        self.n = 0
        self._at = ffi.cast("char *", ffi.from_buffer(self.numbers))
        self._step = 8 * shape.size

    def add(self, copy, e):
        copy(self._at + self.n * self._step)
        self.time[self.n] = e.time
        self.quality[self.n] = e.status, e.iterations, e.kkt_residual, e.solve_time, e.marker_rms, e.emg_rms
        self.n += 1

    def tables(self, shape):
        made = {}
        for name, (begin, end, _) in shape.places.items():
            made[name] = Table(self.time[:self.n], self.numbers[:self.n, begin:end], shape.columns(name), name=name,
                               labels=shape.labels(name) if name == "markers" else None, unit=UNITS[name])
        made["quality"] = Table(self.time[:self.n], self.quality[:self.n], QUALITY, name="quality")
        return made


class _Run:
    """The objects of a run; closed in the order in which they lend to each other."""

    def __init__(self, config):
        self.config = config
        self.error = new_error()
        self.recording = self.findings = ffi.NULL
        self.estimator = Estimator(config)
        try:
            self.recording = self._make("mhe_recording", lib.mhe_recording_open, config.pointer)
            self.info = self._filled("mhe_recording_info", lib.mhe_recording_describe, self.recording)
            self._cover()
            self._start()
            self.findings = self._make("mhe_findings", lib.mhe_findings_open, config.pointer, self.estimator._pointer,
                                       self.recording)
        except BaseException:
            self.close()
            raise

    def close(self):
        lib.mhe_findings_close(self.findings)
        lib.mhe_recording_close(self.recording)
        self.findings = self.recording = ffi.NULL
        self.estimator.close()

    def _make(self, kind, function, *arguments):
        out = ffi.new(f"{kind} **")
        check(function(*arguments, out, self.error), self.error)
        return out[0]

    def _filled(self, kind, function, *arguments):
        struct = ffi.new(f"{kind} *", {"size": ffi.sizeof(kind)})
        check(function(*arguments, struct, self.error), self.error)
        return struct

    def _cover(self):
        n = self.info.n_frames
        if n > 0:
            check(lib.mhe_estimator_covers(self.estimator._pointer, self.info.time[0], self.info.time[n - 1], 0,
                                           self.error), self.error)

    def _start(self):
        """The reference knows how the run begins."""
        if self.info.has_reference:
            truth = self._filled("mhe_truth", lib.mhe_recording_truth, self.recording, 0)
            check(lib.mhe_estimator_set_start(self.estimator._pointer, truth.q, truth.qdot, self.error), self.error)

    def estimate(self, progress):
        e, error, n = self.estimator, self.error, self.info.n_frames
        rows = _Rows(e._shape, n)
        frame, estimate, ready = e._frame, e._estimate, e._ready
        for k in range(n):
            frame.size = ffi.sizeof("mhe_frame")
            check(lib.mhe_recording_frame(self.recording, k, frame, error), error)
            self.config.check(lib.mhe_estimator_push(e._pointer, frame, estimate, ready, error), error)
            if ready[0]:
                check(lib.mhe_findings_add(self.findings, estimate, error), error)
                rows.add(e._copy, estimate)
            if progress is not None:
                progress(k + 1, n)
        if rows.n == 0:
            raise InputError("no frame has a marker or an angle to begin from", lib.MHE_E_INPUT)
        return rows

    def judge(self):
        weight = ffi.new("int32_t *")
        check(lib.mhe_findings_judge(self.findings, weight, self.error), self.error)
        found, finding = [], ffi.new("mhe_finding *", {"size": ffi.sizeof("mhe_finding")})
        while lib.mhe_findings_at(self.findings, len(found), finding, self.error) == 0:
            found.append(Finding(WEIGHT[finding.weight], text(finding.text), text(finding.remedy)))
        out = ffi.new("char **")
        check(lib.mhe_findings_write(self.findings, out, self.error), self.error)
        return VERDICT[weight[0]], found, taken_text(out[0])

    def rmse(self):
        if not self.info.has_reference:
            return {}
        config = self.config
        rmse = ffi.new("mhe_rmse *", {"size": ffi.sizeof("mhe_rmse")})
        check(lib.mhe_findings_rmse(self.findings, int(config.real("output.skip_first")),
                                    int(config.real("output.skip_last")), rmse, self.error), self.error)
        return {name: getattr(rmse, name) for name in RMSE_UNITS}


def run(config, *, folder=None, trust=False, functions=None, progress=None, **keys):
    """Estimates a whole recording, the files of the config's section `data`, as mhe-run does: the same bits.

    Args:
        config, folder, trust, functions, **keys: as for Estimator.
        progress: called as progress(frames done, frames in all); an exception of it ends the run.

    Returns Results. No file is written; `mhe-run` writes tables, page and picture.
    """
    with_config = Config(config, keys, folder=folder, trust=trust, functions=functions)
    try:
        r = _Run(with_config)
        try:
            rows = r.estimate(progress)
            verdict, findings, lines = r.judge()
            return Results(rows.tables(r.estimator._shape), verdict=verdict, findings=findings, text=lines,
                           rmse=r.rmse(), name=with_config.name, config=with_config.write(),
                           dropped=with_config.dropped())
        finally:
            r.close()
    finally:
        with_config.close()


def check_config(config, *, folder=None, trust=False, **keys):
    """What mhe-run --check finds without estimating: (verdict, findings). Raises what cannot be read."""
    with_config = Config(config, keys, folder=folder, trust=trust)
    try:
        r = _Run(with_config)
        try:
            verdict, findings, _ = r.judge()
            return verdict, findings
        finally:
            r.close()
    finally:
        with_config.close()
