# SPDX-License-Identifier: Apache-2.0
"""Streams as they come: what mhe-live does."""
import json
import threading

from ._config import Config
from ._library import check, encode, ffi, lib, new_error, taken_text
from .errors import ClosedError


class Live:
    """A config with the sections `sources` and `sinks`, run as mhe-live does.

        with myohorizon.Live("live.yaml", record="session.xdf") as live:
            live.run(seconds=60)
            print(live.summary()["frames"])

    Args: `folder`: where recordings and MVC files go; `record`: an .xdf to record, which must not exist; `wait`: s to wait
    for all streams, 0: for ever; `config_folder`, `trust`, `functions`, **keys: as folder, trust, functions, **keys of Estimator.
    """

    def __init__(self, config, *, folder=None, record=None, wait=0.0, config_folder=None, trust=False, functions=None, **keys):
        self._pointer = ffi.NULL
        self._lock = threading.Lock()  # of a run
        self._end = threading.RLock()  # of what may come beside it
        self._config = Config(config, keys, folder=config_folder, trust=trust, functions=functions)
        self._error = new_error()
        words = [ffi.NULL if word is None else ffi.new("char[]", encode(word)) for word in (folder, record)]
        setup = ffi.new("mhe_live_setup *", {"size": ffi.sizeof("mhe_live_setup"), "folder": words[0],
                                             "record": words[1], "wait": wait})
        out = ffi.new("mhe_live **")
        try:
            check(lib.mhe_live_open(self._config.pointer, setup, out, self._error), self._error)
        except BaseException:
            self._config.close()
            raise
        self._pointer = out[0]

    def _live(self):
        if self._pointer == ffi.NULL:
            raise ClosedError("it is closed")
        return self._pointer

    def run(self, seconds=0.0):
        """Waits for the streams and estimates until stop(), Ctrl-C, the end of all sources, or `seconds` of
        estimates (0: no end)."""
        self._live()
        found = []

        def work():
            with self._lock:
                if self._pointer != ffi.NULL:
                    found.append(lib.mhe_live_run(self._pointer, seconds, self._error))

        worker = threading.Thread(target=work)
        worker.start()
        try:
            while worker.is_alive():  # the main thread stays open to Ctrl-C
                worker.join(0.1)
        except BaseException:
            self.stop()
            worker.join()
            raise
        if not found:
            raise ClosedError("it is closed")
        check(found[0], self._error)

    def stop(self):
        """Ends run() soon; from any thread."""
        with self._end:  # it may be closed meanwhile
            if self._pointer != ffi.NULL:
                lib.mhe_live_stop(self._pointer)

    def command(self, line):
        """Asks for "record-start", "record-stop", "mvc-start ELECTRODE", "mvc-stop", "label CAME=MODEL" or "stop", done
        between two frames; from any thread, while run() is at work."""
        error, word = new_error(), encode(line)
        with self._end:
            check(lib.mhe_live_command(self._live(), word, error), error)

    def state(self):
        """What the run is at, as its sinks have it, as a dict; from any thread."""
        error, out = new_error(), ffi.new("char **")
        with self._end:
            check(lib.mhe_live_state(self._live(), out, error), error)
        return json.loads(taken_text(out[0]))

    def summary(self):
        """Streams, frames, latencies, sinks, as a dict."""
        with self._lock:
            error, out = new_error(), ffi.new("char **")
            check(lib.mhe_live_summary(self._live(), out, error), error)
            return json.loads(taken_text(out[0]))

    def close(self):
        """Ends it, waits for a run() in another thread, and gives back its memory. Twice is fine."""
        self.stop()
        with self._lock, self._end:
            pointer, self._pointer = self._pointer, ffi.NULL
            lib.mhe_live_close(pointer)
            if pointer != ffi.NULL:
                self._config.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        if getattr(self, "_pointer", ffi.NULL) != ffi.NULL:
            self.close()
