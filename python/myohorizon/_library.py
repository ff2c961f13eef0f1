# SPDX-License-Identifier: Apache-2.0
"""libmhe.so: found, loaded, and its errors made exceptions."""
import os

from . import _binding
from .errors import make_error

ffi = _binding.ffi
texts = _binding.texts


def _candidates():
    """Where libmhe.so may be: what the environment names; the tree that this package lies in, built or installed; what
    the dynamic linker knows."""
    named = os.environ.get("MYOHORIZON_LIBRARY")
    if named:
        return [named]
    found = []
    folder = os.path.dirname(os.path.realpath(__file__))
    for _ in range(5):
        folder = os.path.dirname(folder)
        for lib in ("lib", "lib64"):
            place = os.path.join(folder, lib)
            triplets = [name for name in sorted(os.listdir(place)) if name.endswith("-linux-gnu")] if os.path.isdir(place) else []
            found += [os.path.join(place, below, own, "libmhe.so.0") for below in ("", *triplets) for own in ("mhe", "")]
    return [path for path in found if os.path.exists(path)] + ["libmhe.so.0"]


def _load():
    reasons = []
    for path in _candidates():
        try:
            library = ffi.dlopen(path)
            version = ffi.string(library.mhe_version()).decode()
        except (OSError, AttributeError) as error:
            reasons.append(f"{path}: {error}")
            continue
        if version.split(".")[:2] == texts["MHE_VERSION"].split(".")[:2]:
            return library, path
        reasons.append(f"{path}: is of version {version}, this package of {texts['MHE_VERSION']}")
    raise ImportError("libmhe.so.0 was not found (package myohorizon; or name it in MYOHORIZON_LIBRARY): "
                      + "; ".join(reasons))


lib, path = _load()


def check(status, error):
    """Raises what a status of the library says."""
    if status != 0:
        raise make_error(status, ffi.string(error.text).decode(errors="replace"),
                         ffi.string(lib.mhe_status_text(status)).decode())


def new_error():
    return ffi.new("mhe_error *")


def text(pointer):
    """A text of the library's own; "" where there is none."""
    return "" if pointer == ffi.NULL else ffi.string(pointer).decode(errors="replace")


def names(pointer, n):
    return tuple(text(pointer[i]) for i in range(n))


def taken_text(pointer):
    """A text that the library made for its caller, given back to it."""
    try:
        return text(pointer)
    finally:
        lib.mhe_free(pointer)


def encode(path_or_text):
    """A path or a text as the library takes it."""
    data = os.fsencode(path_or_text)
    if b"\0" in data:
        raise ValueError(f"{path_or_text!r}: a NUL byte in a text")
    return data


# Structs before the callbacks that take them: cffi 2.0 aborts where a function's type is first met within itself.
for _struct in ("mhe_host", "mhe_own_costs", "mhe_problem"):
    ffi.sizeof(_struct)


@ffi.callback("python_log")
def _log(_host, level, line):
    import logging  # not at import: most programs never get a message
    levels = (logging.ERROR, logging.WARNING, logging.INFO, logging.DEBUG)
    logging.getLogger("myohorizon").log(levels[min(max(level, 0), 3)], "%s", text(line))


@ffi.callback("python_service")
def _no_service(_host, _id):
    return ffi.NULL


def new_host(service=None):
    """What the library hands messages to: the logger "myohorizon". `service`: a cffi callback, kept by the caller."""
    host = ffi.new("mhe_host *")
    host.size = ffi.sizeof("mhe_host")
    host.log = _log
    host.service = service or _no_service
    return host


host = new_host()
