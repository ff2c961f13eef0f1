# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, as exceptions. Each holds the library's line, and the file and line that it names."""
import re


class Error(Exception):
    """Anything that the library refuses.

    Attributes:
        text: the whole message, one line: "file:line: what is wrong, and what would be right".
        file: the file that it names; None where it names none.
        line: its line, from 1; None where it names none.
        status: the library's number, MHE_E_* of mhe/abi.h.
    """

    def __init__(self, text, status=0):
        super().__init__(text)
        self.text = text
        self.status = status
        found = re.match(r"(?P<file>[^:\n]+):(?:(?P<line>\d+):)?(?:\d+:)? ", text)
        is_file = found is not None and ("/" in found["file"] or "." in found["file"] or found["line"] is not None)
        self.file = found["file"] if is_file and " " not in found["file"].split("/")[-1] else None
        self.line = int(found["line"]) if self.file is not None and found["line"] else None


class ArgumentError(Error, ValueError):
    """An argument is not valid: a wrong shape, a name that there is none of, a time that does not increase."""


class ConfigError(Error):
    """The configuration is wrong."""


class InputError(Error):
    """A file, or what was measured, is wrong."""


class PluginError(Error):
    """A plugin is missing or was refused."""


class UnsupportedError(Error):
    """A model or a file holds what is not supported."""


class NumericError(Error):
    """The computation failed."""


class OutputError(Error, OSError):
    """A file, a port or a stream could not be opened or written."""


class Interrupted(Error):
    """Ended by stop()."""


class ClosedError(Error, ValueError):
    """Used after close()."""


class ThreadError(Error, RuntimeError):
    """Used by two threads at once."""


_KINDS = {-1: ArgumentError, -3: ConfigError, -4: InputError, -5: PluginError, -6: UnsupportedError,
          -7: NumericError, -8: OutputError, -9: Interrupted}


def make_error(status, text, meaning):
    if status == -2:
        return MemoryError(text or meaning)
    return _KINDS.get(status, Error)(text or meaning, status)
