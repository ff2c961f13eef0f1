# SPDX-License-Identifier: Apache-2.0
"""Programs beside the library, for what runs in processes of its own."""
import os
import shutil
import subprocess

from . import _library
from ._config import assignments
from .errors import InputError, NumericError, OutputError


def find(name):
    """The program beside the library, or the one of the PATH."""
    folder = os.path.dirname(os.path.realpath(_library.path)) if "/" in _library.path else ""
    for place in ("../bin", "../../bin", "../../../bin"):
        path = os.path.join(folder, place, name)
        if folder and os.access(path, os.X_OK):
            return path
    found = shutil.which(name)
    if found is None:
        raise OutputError(f"{name} is not found (package myohorizon)")
    return found


def run(name, words, keys):
    """Runs it with assignments; returns (status, its last line, all that it said). What is wrong with the input is InputError."""
    sets = [word for assignment in assignments(keys) for word in ("--set", assignment)]
    done = subprocess.run([find(name), *words, *sets], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    lines = done.stderr.strip().splitlines()
    message = lines[-1].removeprefix(f"{name}: ") if lines else ""
    if done.returncode == 2:
        raise InputError(message)
    return done.returncode, message, done.stderr


def failed(name, status, message):
    return NumericError(message or f"{name} ended with status {status}")
