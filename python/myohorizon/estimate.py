# SPDX-License-Identifier: Apache-2.0
"""What an estimator hands back, with names and units."""
from collections.abc import Mapping

import numpy as np

from ._library import ffi, lib, names, text

STATUS = ("ok", "iteration_limit", "deadline", "predicted", "restarted")
PHASE = ("empty", "filling", "beginning", "settling", "running")

# Quantities of an estimate with their units, in the order of its numbers.
UNITS = {"q": "rad (m)", "qdot": "rad/s (m/s)", "activation": "1", "excitation": "1", "force": "N",
         "moment": "N m (N)", "residual": "N m (N)", "markers": "m", "reactions": "N, N m",
         "q_sd": "rad (m)", "activation_sd": "1", "force_sd": "N", "moment_sd": "N m (N)"}


# Quantities of several numbers an entry: how many, and what a column's name ends with.
PARTS = {"markers": (3, (".x", ".y", ".z")), "reactions": (6, ("_fx", "_fy", "_fz", "_mx", "_my", "_mz"))}


class Shape:
    """Which quantities an estimate has, how many numbers each and under which names."""

    def __init__(self, info):
        self.coordinates = names(info.coordinate_names, info.n_q)
        self.muscles = names(info.muscle_names, info.n_muscles)
        self.markers = names(info.marker_names, info.n_markers)
        self.joints = names(info.joint_names, info.n_joints)
        n_q, n_m = info.n_q, info.n_muscles
        sizes = {"q": n_q, "qdot": n_q, "activation": n_m, "force": n_m, "moment": n_q}
        if info.formulation == lib.MHE_FORMULATION_EXCITATION:
            sizes["excitation"] = n_m
        if info.n_residual_torques > 0:
            sizes["residual"] = info.n_residual_torques
        if info.n_markers > 0:
            sizes["markers"] = 3 * info.n_markers
        if info.n_joints > 0:
            sizes["reactions"] = 6 * info.n_joints
        if info.uncertainty:
            sizes.update(q_sd=n_q, activation_sd=n_m, force_sd=n_m, moment_sd=n_q)
        self.places = {}
        self.size = 0
        for name in UNITS:
            if name in sizes:
                parts = PARTS[name][0] if name in PARTS else 1
                shape = (sizes[name] // parts, parts) if parts > 1 else (sizes[name],)
                self.places[name] = (self.size, self.size + sizes[name], shape)
                self.size += sizes[name]
        block = ffi.NULL
        for i in range(info.layout.n_blocks):
            block = info.layout.blocks + i  # of this header's size: the library is of the same version
            if text(block.name) == "residual_torque":
                self.residuals = names(block.entry_names, block.count)
                break
        else:
            self.residuals = ()

    def labels(self, name):
        """Names of the numbers of a quantity: coordinates, muscles, markers."""
        if name not in self.places:
            raise KeyError(f"an estimate has no {name!r}; it has {', '.join(self.places)}")
        if name in ("q", "qdot", "moment", "q_sd", "moment_sd"):
            return self.coordinates
        if name in PARTS:
            return self.markers if name == "markers" else self.joints
        return self.residuals if name == "residual" else self.muscles

    def columns(self, name):
        """The same, a name a number: "DELT.x"."""
        labels = self.labels(name)
        return tuple(label + end for label in labels for end in PARTS[name][1]) if name in PARTS else labels

    def copier(self, estimate):
        """A function that copies the numbers of `estimate` to an address."""
        moves = tuple((name, 8 * begin, 8 * (end - begin)) for name, (begin, end, _) in self.places.items())
        memmove = ffi.memmove

        def copy(to):
            for name, offset, n in moves:
                memmove(to + offset, getattr(estimate, name), n)
        return copy


class Estimate(Mapping):
    """What is known of one moment: a mapping of numpy arrays, which are attributes too.

    ==============  ===================  ======  ==========================================================
    name            shape                unit    what
    ==============  ===================  ======  ==========================================================
    ``q``           [n_coordinates]      rad     coordinates (m of sliders)
    ``qdot``        [n_coordinates]      rad/s   their velocities (m/s)
    ``activation``  [n_muscles]          1       activations, 0 to 1
    ``excitation``  [n_muscles]          1       excitations; excitation-driven only
    ``force``       [n_muscles]          N       muscle forces along the tendon
    ``moment``      [n_coordinates]      N m     joint moments by the muscles (N)
    ``residual``    [n_residual]         N m     residual torques, where switched on (N)
    ``markers``     [n_markers, 3]       m       positions in the ground frame of the model
    ``reactions``   [n_joints, 6]        N, N m  force and moment on the body that a joint carries, where ``output.reactions`` is
                                                 on; NaN: none could be found
    ``q_sd`` ..                                  standard deviations of ``q``, ``activation``, ``force``, ``moment``, where
                                                 ``output.uncertainty`` is on
    ==============  ===================  ======  ==========================================================

    Arrays are the estimate's own. Beside them, as plain numbers: ``time`` (s, of the moment that is estimated),
    ``status`` ("ok", "iteration_limit", "deadline", "predicted", "restarted"), ``iterations``, ``kkt_residual``,
    ``solve_time`` and ``latency`` (s), ``marker_rms`` (m), ``emg_rms`` (1; NaN without), ``phase``.
    """

    __slots__ = ("_shape", "_numbers", "time", "_status", "iterations", "kkt_residual", "solve_time", "latency",
                 "marker_rms", "emg_rms", "_phase")
    units = UNITS

    def __init__(self, shape, numbers, e):
        self._shape = shape
        self._numbers = numbers
        self.time = e.time
        self._status = e.status
        self.iterations = e.iterations
        self.kkt_residual = e.kkt_residual
        self.solve_time = e.solve_time
        self.latency = e.latency
        self.marker_rms = e.marker_rms
        self.emg_rms = e.emg_rms
        self._phase = e.phase

    def __getitem__(self, name):
        begin, end, shape = self._shape.places[name]
        return self._numbers[begin:end].reshape(shape)

    def __getattr__(self, name):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"an estimate has no {name!r}; it has {', '.join(self._shape.places)}") from None

    def __iter__(self):
        return iter(self._shape.places)

    def __len__(self):
        return len(self._shape.places)

    def __reduce__(self):
        raise TypeError("an estimate is not to be pickled; dict(estimate) is")

    @property
    def status(self):
        return STATUS[self._status]

    @property
    def phase(self):
        return PHASE[self._phase]

    def labels(self, name):
        """Names of the entries of a quantity: coordinates, muscles, markers or joints."""
        return self._shape.labels(name)

    def named(self, name):
        """A quantity as a dict, {"BRA": 12.5, ...}; of markers {"DELT": array [3], ...}."""
        values = self[name]
        return dict(zip(self._shape.labels(name), values if values.ndim > 1 else values.tolist()))

    def __repr__(self):
        return f"<Estimate at {self.time:.4f} s, {self.status}: {', '.join(self)}>"
