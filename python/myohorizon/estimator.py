# SPDX-License-Identifier: Apache-2.0
"""The estimator, frame by frame."""
import threading

import numpy as np

from ._arrays import DOUBLE, copied, doubles
from ._config import Config
from ._library import check, encode, ffi, lib, names, new_error, text
from ._turn import Turn
from .errors import ArgumentError, ClosedError
from .estimate import PHASE, Estimate, Shape

WHY = ("used", "missing", "far", "saturated", "unread")


class Estimator:
    """Moving horizon estimator: frames in, estimates out.

        with myohorizon.Estimator("arm.yaml", horizon__window=7) as estimator:
            for t, markers, emg in instrument:
                estimate = estimator.push(t, markers, emg)
                if estimate is not None:
                    print(estimate.time, estimate.force)
                estimator.prepare()

    Args:
        config: path of a YAML file; or a dict; or the YAML itself, a text of several lines. Relative paths in it start
            at the file's folder, in a dict or text at `folder` (else the working directory).
        folder: see there.
        trust: follow a `plugin_path` in the file. A plugin is code that runs as soon as its folder is searched.
        functions: {name: myohorizon.Cost}, for costs of the plugin mhe.cost.callback (see Cost).
        **keys: assignments to the config as with --set: `horizon__window=9`, or `**{"horizon.window": 9}`.

    One estimator belongs to one thread at a time (another gets ThreadError); several are independent. While the library
    works the interpreter's lock is released.

    Raises ConfigError, InputError, PluginError, UnsupportedError; their `file` and `line` say where.
    """

    def __init__(self, config, *, folder=None, trust=False, functions=None, **keys):
        self._pointer = ffi.NULL
        self._turn = Turn()
        self._end = threading.RLock()
        self._owns_config = not isinstance(config, Config)
        self._config = Config(config, keys, folder=folder, trust=trust, functions=functions) if self._owns_config else config
        self._error = new_error()
        out = ffi.new("mhe_estimator **")
        try:
            self._config.check(lib.mhe_estimator_create(self._config.pointer, out, self._error), self._error)
        except BaseException:
            if self._owns_config:
                self._config.close()
            raise
        self._pointer = out[0]
        self._frame = ffi.new("mhe_frame *", {"size": ffi.sizeof("mhe_frame")})
        self._estimate = ffi.new("mhe_estimate *", {"size": ffi.sizeof("mhe_estimate")})
        self._ready = ffi.new("int32_t *")
        self._info = ffi.new("mhe_estimator_info *", {"size": ffi.sizeof("mhe_estimator_info")})
        self._describe()
        self._shape = Shape(self._info)
        self._copy = self._shape.copier(self._estimate)
        self._has_estimate = False
        self._shapes = {"markers": ((self._info.n_markers, 3), self._shape.markers),
                        "emg": ((self._info.n_muscles,), self._shape.muscles),
                        "angles": ((self._info.n_q,), self._shape.coordinates)}
        self._n_columns = 0
        self._calls_back = self._config.calls_back

    def _describe(self):
        check(lib.mhe_estimator_describe(self._pointer, self._info), self._error)
        return self._info

    # ---- frames ----

    def push(self, t, markers=None, emg=None, angles=None):
        """Takes the next frame; returns an Estimate, or None where there is none (the window fills, or this frame is not
        one of every `horizon.ratio`-th).

        Args:
            t: time of the frame, s; it must increase.
            markers: [n_markers, 3], m, ground frame, in the order of `marker_names`; or {name: (x, y, z)}.
            emg: [n_muscles], normalised 0..1, in the order of `muscle_names`; or {name: value}.
            angles: [n_coordinates], rad (m), in the order of `coordinate_names`; or {name: value}.

        NaN is a missing value; None: all missing. Arrays of float64 in C order are taken as they are, others are
        converted; a wrong shape is ArgumentError, what is no number TypeError.
        """
        self._turn.enter()
        try:
            frame = self._frame
            frame.time = t
            frame.markers = a = self._address("markers", markers)
            frame.emg = b = self._address("emg", emg)
            frame.angles = c = self._address("angles", angles)
            ready = self._ready
            status = lib.mhe_estimator_push(self._pointer, frame, self._estimate, ready, self._error)
            del a, b, c  # lent until here
            if status != 0 or self._calls_back:
                self._has_estimate = False
                self._config.check(status, self._error)
            if not ready[0]:
                self._has_estimate = False
                return None
            self._has_estimate = True
            shape = self._shape
            numbers = np.empty(shape.size)
            self._copy(ffi.cast("char *", ffi.from_buffer(numbers)))
            return Estimate(shape, numbers, self._estimate)
        finally:
            self._turn.leave()

    def _address(self, name, values):
        """Where the numbers of an argument lie; what is handed back keeps them there."""
        if values is None:
            return ffi.NULL
        shape, labels = self._shapes[name]
        if not (type(values) is np.ndarray and values.dtype == DOUBLE and values.shape == shape
                and values.flags.c_contiguous):
            values = doubles(name, values, shape, labels)
        return ffi.from_buffer("double[]", values)

    def prepare(self):
        """Does what can be done before the next frame is there, so that its estimate comes sooner. Results are the same
        with and without it."""
        self._turn.enter()
        try:
            self._config.check(lib.mhe_estimator_prepare(self._pointer, self._error), self._error)
        finally:
            self._turn.leave()

    def measure(self, channel, t, values):
        """A measurement of one channel ("markers", "emg", "angles", or another of `channels`) at a time of its own, s,
        earlier or later than the newest frame: it goes to the node of its time while that is in the window."""
        self._turn.enter()
        try:
            number = lib.mhe_estimator_find_channel(self._pointer, encode(channel))
            if number < 0:
                raise ArgumentError(f"there is no channel '{channel}'; there are {', '.join(self._channel_names())}")
            row = lib_channel(self._describe(), number)
            values = doubles(channel, values, (row.width,), names(row.columns, row.width))
            check(lib.mhe_estimator_measure(self._pointer, number, t, ffi.from_buffer("double[]", values), self._error),
                  self._error)
        finally:
            self._turn.leave()

    def open_emg(self, columns, rate):
        """From now on raw EMG of electrodes comes by push_emg, and the section `emg` of the config makes muscles' EMG of
        it. `columns`: names of the samples' numbers, among them the config's channels; `rate` in Hz. Before the first
        push."""
        if isinstance(columns, str):
            raise TypeError("columns: a list of names is needed, not one text")
        words = [ffi.new("char[]", encode(column)) for column in columns]
        self._turn.enter()
        try:
            check(lib.mhe_estimator_open_emg(self._pointer, ffi.new("char *[]", words), len(words), rate, self._error), self._error)
            self._n_columns = len(words)
        finally:
            self._turn.leave()

    def push_emg(self, t, raw):
        """Raw EMG: one sample [n_columns] at time t (s), or several: t [n], raw [n, n_columns]. In the columns' units,
        NaN where missing."""
        self._turn.enter()
        try:
            n = self._n_columns
            if n == 0:
                raise ArgumentError("raw EMG has no columns yet: open_emg(columns, rate) comes first")
            times = np.atleast_1d(np.asarray(t, dtype=DOUBLE))
            shape = (times.size, n) if np.ndim(raw) == 2 else (n,)
            rows = doubles("raw", raw, shape, ("columns",) * n).reshape(-1, n)
            if times.ndim != 1 or len(rows) != len(times):
                raise ArgumentError(f"raw: {len(rows)} samples, but {times.size} times")
            pointer = ffi.from_buffer("double[]", rows)
            for k, time in enumerate(times.tolist()):
                check(lib.mhe_estimator_push_emg(self._pointer, time, pointer + k * n, self._error), self._error)
        finally:
            self._turn.leave()

    def tracked(self):
        """What the last estimate tracked, {channel: {...}} with copies of measured, target, weight, why and estimated
        (arrays, a number an entry), n_left_out, rms; {} where the last push gave no estimate. `why`: "used", "missing",
        "far", "saturated" or "unread"."""
        self._turn.enter()
        try:
            found = {}
            if not self._has_estimate:
                return found
            info, e = self._describe(), self._estimate
            for i in range(e.n_tracked):
                t = ffi.cast("mhe_tracked *", ffi.cast("char *", e.tracked) + i * e.tracked_size)
                row = lib_channel(info, t.channel)
                arrays = {name: copied(getattr(t, name), row.width)
                          for name in ("measured", "target", "weight", "estimated")}
                why = [WHY[t.why[k]] for k in range(row.width)]
                found[text(row.name)] = {**arrays, "why": why, "columns": names(row.columns, row.width),
                                         "n_measured": t.n_measured, "n_left_out": t.n_left_out, "rms": t.rms}
            return found
        finally:
            self._turn.leave()

    # ---- before the first frame ----

    def set_start(self, q=None, qdot=None):
        """The first state where the config leaves it open: q, qdot [n_coordinates] or {name: value}; NaN: not known."""
        self._turn.enter()
        try:
            shape, labels = self._shapes["angles"]
            addresses = [ffi.NULL if v is None else ffi.from_buffer("double[]", doubles(name, v, shape, labels))
                         for name, v in (("q", q), ("qdot", qdot))]
            check(lib.mhe_estimator_set_start(self._pointer, *addresses, self._error), self._error)
        finally:
            self._turn.leave()

    def set_node(self, node):
        """Whose estimates are given: 0, the window's oldest frame, to `window`, the newest."""
        self._turn.enter()
        try:
            check(lib.mhe_estimator_set_node(self._pointer, node, self._error), self._error)
        finally:
            self._turn.leave()

    def set_deadline(self, seconds):
        """Time from a frame to its estimate after which a solve ends with what it has, s; 0: no limit."""
        self._turn.enter()
        try:
            check(lib.mhe_estimator_set_deadline(self._pointer, seconds, self._error), self._error)
        finally:
            self._turn.leave()

    # ---- what it is ----

    def _get(self, read):
        self._turn.enter()
        try:
            return read(self._describe())
        finally:
            self._turn.leave()

    @property
    def coordinate_names(self):
        return self._shape.coordinates

    @property
    def muscle_names(self):
        return self._shape.muscles

    @property
    def marker_names(self):
        return self._shape.markers

    @property
    def window(self):
        """Intervals in the window."""
        return self._get(lambda info: info.window)

    @property
    def ratio(self):
        """Every so many-th frame is used."""
        return self._get(lambda info: info.ratio)

    @property
    def interval(self):
        """s between the window's nodes; 0 until it was full once."""
        return self._get(lambda info: info.interval)

    @property
    def node(self):
        """Whose estimates are given: 0 the oldest frame of the window, `window` the newest."""
        return self._get(lambda info: info.node)

    @property
    def delay(self):
        """s from that node to the newest frame."""
        return self._get(lambda info: info.delay)

    @property
    def phase(self):
        """"empty", "filling", "beginning", "settling" or "running"."""
        return self._get(lambda info: PHASE[info.phase])

    @property
    def emg_lag(self):
        """s by which raw EMG comes late: the filters' delay less the electromechanical delay."""
        return self._get(lambda info: lib.mhe_estimator_emg_lag(self._pointer))

    @property
    def channels(self):
        """What is measured: {name: {columns, units, signal, delay, gap}}."""
        return self._get(_channels)

    @property
    def dropped(self):
        """Elements of the model file that were left out, "file:line: what"."""
        return self._get(lambda info: self._config.dropped())

    @property
    def config(self):
        """The whole configuration with every default, as YAML."""
        return self._get(lambda info: self._config.write())

    def _channel_names(self):
        return list(_channels(self._describe()))

    # ---- its end ----

    def stop(self):
        """Ends the push that is at work in another thread, and every later one: they raise Interrupted. From any
        thread."""
        with self._end:  # it may be closed meanwhile
            if self._pointer != ffi.NULL:
                lib.mhe_estimator_stop(self._pointer, 1)

    def close(self):
        """Gives back its memory; waits for a push that is at work in another thread, and refuses the next. Twice is
        fine."""
        self._turn.last()
        try:
            with self._end:
                pointer, self._pointer = self._pointer, ffi.NULL
            lib.mhe_estimator_close(pointer)
            if pointer != ffi.NULL and self._owns_config:
                self._config.close()
        finally:
            self._turn.leave()

    @property
    def closed(self):
        return self._pointer == ffi.NULL

    def __enter__(self):
        if self.closed:
            raise ClosedError("the estimator is closed")
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        if getattr(self, "_pointer", ffi.NULL) != ffi.NULL:
            self.close()

    def __reduce__(self):
        raise TypeError("an estimator is not to be pickled or copied; open another of the same config")

    def __repr__(self):
        state = "closed" if self.closed else f"{len(self.coordinate_names)} coordinates, {len(self.muscle_names)} muscles, " \
                                             f"{len(self.marker_names)} markers"
        return f"<Estimator {state}>"


def lib_channel(info, i):
    return ffi.cast("mhe_channel *", ffi.cast("char *", info.channels) + i * info.channel_size)


def _channels(info):
    rows = [lib_channel(info, i) for i in range(info.n_channels)]
    return {text(row.name): {"columns": names(row.columns, row.width), "units": names(row.units, row.width),
                             "signal": text(row.signal), "delay": row.delay, "gap": row.gap} for row in rows}
