# SPDX-License-Identifier: Apache-2.0
"""A configuration: a file, a text, or a dict, with assignments."""
import json
import os

from ._library import check, encode, ffi, lib, new_error, new_host, taken_text, text
from . import _library
from .errors import NumericError

TRUST = 1


def as_text(value):
    """A Python value as YAML of one line (JSON is YAML)."""
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return value
    return json.dumps(value, default=_plain, allow_nan=False, ensure_ascii=False)


def _plain(value):
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # of numpy
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no form in a configuration: {value!r}")


def assignments(keys):
    """{"horizon.window": 9} and {"horizon__window": 9} as "horizon.window=9"."""
    return [f"{key.replace('__', '.')}={as_text(value)}" for key, value in keys.items()]


class Config:
    """A configuration, read and checked; owned by what was made from it."""

    def __init__(self, source, keys=None, *, folder=None, trust=False, functions=None):
        from .costs import serve  # costs know configurations' names only
        self._pointer = ffi.NULL
        service, self._kept = serve(functions)
        self._host = _library.host if service is None else new_host(service)
        error = new_error()
        out = ffi.new("mhe_config **")
        words = [ffi.new("char[]", encode(word)) for word in assignments(keys or {})]
        array = ffi.new("char *[]", words) if words else ffi.NULL
        flags = TRUST if trust else 0
        if isinstance(source, dict):
            content = json.dumps(source, default=_plain, allow_nan=False, ensure_ascii=False).encode()
            status = lib.mhe_config_parse(b"config", content, len(content), _folder(folder), array, len(words), flags,
                                          self._host, out, error)
        elif isinstance(source, str) and "\n" in source:
            content = source.encode()
            status = lib.mhe_config_parse(b"config", content, len(content), _folder(folder), array, len(words), flags,
                                          self._host, out, error)
        elif isinstance(source, (str, bytes, os.PathLike)):
            if folder is not None:
                raise TypeError("folder= is for a configuration given as a dict or a text; a file has its own")
            status = lib.mhe_config_read(encode(source), array, len(words), flags, self._host, out, error)
        else:
            raise TypeError("a configuration is a path, a dict, or a text of several lines, not "
                            f"{type(source).__name__}")
        check(status, error)
        self._pointer = out[0]

    def check(self, status, error):
        """Raises what a status says, and what a cost in Python raised, whatever the status."""
        cause = getattr(self._kept, "cause", None)
        if cause is None:
            check(status, error)
            return
        self._kept.cause = None
        if not isinstance(cause, Exception):  # Ctrl-C while a cost was at work
            raise cause
        raise NumericError(f"a cost in Python: {type(cause).__name__}: {cause}", lib.MHE_E_NUMERIC) from cause

    @property
    def calls_back(self):
        """Costs in Python are at work."""
        return self._kept is not None

    @property
    def pointer(self):
        return self._pointer

    @property
    def name(self):
        return text(lib.mhe_config_name(self._pointer))

    def write(self):
        """Every key with its value: YAML that reads back the same."""
        error, out = new_error(), ffi.new("char **")
        check(lib.mhe_config_write(self._pointer, out, error), error)
        return taken_text(out[0])

    def get(self, key):
        """The value of a key as one line of YAML."""
        error, out = new_error(), ffi.new("char **")
        check(lib.mhe_config_get(self._pointer, encode(key), out, error), error)
        return taken_text(out[0])

    def real(self, key):
        error, out = new_error(), ffi.new("double *")
        check(lib.mhe_config_get_real(self._pointer, encode(key), out, error), error)
        return out[0]

    def dropped(self):
        lines, i = [], 0
        while (line := lib.mhe_config_dropped(self._pointer, i)) != ffi.NULL:
            lines.append(text(line))
            i += 1
        return lines

    def close(self):
        pointer, self._pointer = self._pointer, ffi.NULL
        lib.mhe_config_close(pointer)

    def __del__(self):
        if getattr(self, "_pointer", ffi.NULL) != ffi.NULL:
            self.close()


def _folder(folder):
    return ffi.NULL if folder is None else ffi.new("char[]", encode(folder))
