# SPDX-License-Identifier: Apache-2.0
"""Time series in files, and tables of results."""
from typing import NamedTuple, Optional

import numpy as np

from ._library import check, encode, ffi, lib, names, new_error, text
from .errors import InputError


class Table:
    """A time series: named columns of numbers over time.

    Attributes:
        time: [n_rows], s.
        values: [n_rows, n_columns], NaN: missing.
        columns: names of the columns, without time; of markers "DELT.x", "DELT.y", "DELT.z".
        labels: the same a marker, else the columns.
        unit: of the values; "" where the file does not tell. Markers are in m, whatever the file has.
        rate: Hz, of the header or the median step; 0 where it is not known.
        in_degrees: the header of a .sto or .mot says so; values are as in the file.
        warnings: what of the file was repaired or skipped, with file:line.

    `table["BRA"]` is a column [n_rows], of markers [n_rows, 3]. `pandas()` and `xarray()` make what those have.
    """

    def __init__(self, time, values, columns, *, labels=None, unit="", rate=0.0, in_degrees=False, warnings=(), name=""):
        self.time = np.asarray(time)
        self.values = np.asarray(values)
        self.columns = tuple(columns)
        self.labels = self.columns if labels is None else tuple(labels)
        self.unit = unit
        self.rate = rate
        self.in_degrees = in_degrees
        self.warnings = tuple(warnings)
        self.name = name

    @property
    def is_markers(self):
        return self.labels is not self.columns

    def __getitem__(self, name):
        if name in self.labels:
            i = self.labels.index(name)
            return self.values[:, 3 * i:3 * i + 3] if self.is_markers else self.values[:, i]
        if name in self.columns:
            return self.values[:, self.columns.index(name)]
        raise KeyError(f"{self.name or 'the table'} has no '{name}'; it has {', '.join(self.labels)}")

    def __contains__(self, name):
        return name in self.labels or name in self.columns

    def __len__(self):
        return len(self.time)

    def pandas(self):
        """A DataFrame with the time (s) as index."""
        import pandas
        frame = pandas.DataFrame(self.values, index=pandas.Index(self.time, name="time"), columns=list(self.columns))
        frame.attrs["unit"] = self.unit
        return frame

    def xarray(self):
        """A DataArray, time x column; of markers time x marker x axis."""
        import xarray
        if self.is_markers:
            return xarray.DataArray(self.values.reshape(len(self), -1, 3), name=self.name or None,
                                    coords={"time": self.time, "marker": list(self.labels), "axis": list("xyz")},
                                    dims=("time", "marker", "axis"), attrs={"unit": self.unit})
        return xarray.DataArray(self.values, name=self.name or None, dims=("time", "column"), attrs={"unit": self.unit},
                                coords={"time": self.time, "column": list(self.columns)})

    def __repr__(self):
        what = f"{len(self.labels)} markers" if self.is_markers else f"{len(self.columns)} columns"
        span = f", {self.time[0]:.4g} to {self.time[-1]:.4g} s" if len(self) else ""
        return f"<Table {self.name} {len(self)} rows x {what}{span}>".replace("  ", " ")


class Motion(NamedTuple):
    """What a .c3d or .xdf holds; None: no such part."""

    markers: Optional[Table]
    signals: Optional[Table]


def _read(function, path, markers):
    error, out = new_error(), ffi.new("mhe_table **")
    check(function(encode(path), out, error), error)
    table = out[0]
    try:
        info = ffi.new("mhe_table_info *", {"size": ffi.sizeof("mhe_table_info")})
        check(lib.mhe_table_describe(table, info, error), error)
        n, width = info.n_rows, info.n_columns
        labels = names(info.labels, info.n_labels)
        columns = [f"{label}.{axis}" for label in labels for axis in "xyz"] if markers else labels
        return Table(_array(info.time, n), _array(info.values, n * width).reshape(n, width), columns,
                     labels=labels if markers else None, unit="m" if markers else "", rate=info.rate,
                     in_degrees=bool(info.in_degrees), warnings=names(info.warnings, info.n_warnings))
    finally:
        lib.mhe_table_close(table)


def _array(pointer, n):
    return np.frombuffer(ffi.buffer(pointer, 8 * n)).copy() if n > 0 else np.empty(0)


def read_trc(path):
    """Markers of a .trc, as a Table in m."""
    return _read(lib.mhe_table_read_markers, path, True)


def read_sto(path):
    """Signals of a .sto, .mot or .csv, as a Table; values as in the file (see Table.in_degrees)."""
    return _read(lib.mhe_table_read_signals, path, False)


def _read_both(path):
    parts, why = [], None
    for function, markers in ((lib.mhe_table_read_markers, True), (lib.mhe_table_read_signals, False)):
        try:
            parts.append(_read(function, path, markers))
        except InputError as error:
            parts.append(None)
            why = why or error
    if parts == [None, None]:
        raise why
    return Motion(*parts)


def read_c3d(path):
    """Markers (m) and analog signals of a .c3d, as (markers, signals); None for what it has not."""
    return _read_both(path)


def read_xdf(path):
    """Markers (m) and EMG of an .xdf of Lab Streaming Layer, as (markers, signals); None for what it has not."""
    return _read_both(path)
