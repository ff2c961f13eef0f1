# SPDX-License-Identifier: Apache-2.0
"""What a caller gives, as arrays that the library can read."""
from collections.abc import Mapping

import numpy as np

from ._library import ffi
from .errors import ArgumentError

DOUBLE = np.dtype(np.float64)


def doubles(name, values, shape, labels):
    """An array of `shape` as float64 in C order. What has another shape or type is refused, not guessed."""
    if isinstance(values, Mapping):
        return _by_name(name, values, shape, labels)
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(DOUBLE), np.nan)
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ArgumentError(f"{name}: {error}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {array.dtype} (missing values are NaN)")
    if array.shape != shape:
        per = " x 3" if len(shape) > 1 else ""
        raise ArgumentError(f"{name}: the shape is {list(array.shape)}; this model takes {list(shape)}: "
                            f"{len(labels)}{per}, in the order {', '.join(labels[:4])}{', ...' if len(labels) > 4 else ''}")
    return np.ascontiguousarray(array, dtype=DOUBLE)


def _by_name(name, values, shape, labels):
    array = np.full(shape, np.nan)
    for label, value in values.items():
        if label not in labels:
            raise ArgumentError(f"{name}: the model has no '{label}'; it has {', '.join(labels)}")
        try:
            array[labels.index(label)] = value
        except (TypeError, ValueError) as error:
            raise ArgumentError(f"{name}: '{label}': {error}") from None
    return array


def copied(pointer, n):
    """An array of its own of n doubles of the library's."""
    return np.frombuffer(ffi.buffer(pointer, 8 * n)).copy() if n > 0 else np.empty(0)
