# SPDX-License-Identifier: Apache-2.0
"""Costs written in Python, for trying out."""
import traceback

import numpy as np

from ._library import encode, ffi, lib, text, texts

AT = {"node": 0, "previous": 1, "first": 2}
_STEP = np.cbrt(np.finfo(float).eps)


class Cost:
    """A cost in Python, for trying out: residuals r of signals y of the model at one node.

        effort = myohorizon.Cost("activation", lambda y, target: y - 0.05)
        myohorizon.run("arm.yaml", functions={"effort": effort},
                       costs=[{"plugin": "mhe.cost.emg-markers-high"},
                              {"plugin": "mhe.cost.callback", "function": "effort", "weight": 0.1}])

    Args:
        signals: name of the signal that is read (mhe/cost.h: "markers" m, "q" rad, "qdot" rad/s, "activation",
            "excitation", "muscle_force" N, "joint_moment" N m, "residual_torque" N m), or several: y is then their
            concatenation. ("q", "previous") is that of the node before, ("q", "first") that of the window's first node.
        residual: residual(y, target) -> r [n_res]; y and target [n_y] are copies; NaN in target: not measured.
        jacobian: jacobian(y, target) -> dr/dy [n_res, n_y]; left out: central differences.
        n_res: number of residuals; left out: as many as y has.
        unit: of r.
        fills_missing: r can be finite where the target is NaN.

    A NaN in y must come through to r. The sum over nodes, `weight`, `sigma` and `huber` are the library's. This is slow,
    tens of microseconds a call, and holds the interpreter's lock; for a cost that stays write a plugin, 60 lines of C.
    An exception ends the run: it becomes an Error, with the exception as its cause.
    """

    def __init__(self, signals, residual, jacobian=None, *, n_res=None, unit="1", fills_missing=False):
        if isinstance(signals, str) or (isinstance(signals, tuple) and len(signals) == 2 and signals[1] in AT):
            signals = [signals]
        self.signals = [(signal, "node") if isinstance(signal, str) else tuple(signal) for signal in signals]
        for signal in self.signals:
            if len(signal) != 2 or signal[1] not in AT:
                raise ValueError(f"signals: a name, or (name, 'node', 'previous' or 'first'), not {signal!r}")
        if not callable(residual) or not (jacobian is None or callable(jacobian)):
            raise TypeError("residual and jacobian are functions of (y, target)")
        self.residual = residual
        self.jacobian = jacobian
        self.n_res = n_res
        self.fills_missing = fills_missing
        self._unit = ffi.new("char[]", encode(unit))


class _Bound:
    """A cost on one problem."""

    def __init__(self, cost):
        self.cost = cost
        self.n_res = 0

    def residual(self, y, target):
        r = np.asarray(self.cost.residual(y, target), dtype=float).reshape(-1)
        if r.size != self.n_res:
            raise ValueError(f"residual() gave {r.size} numbers, not {self.n_res} (n_res)")
        return r

    def jacobian(self, y, target):
        if self.cost.jacobian is None:
            return self._differences(y, target)
        J = np.asarray(self.cost.jacobian(y, target), dtype=float)
        if J.shape != (self.n_res, y.size):
            raise ValueError(f"jacobian() gave {list(J.shape)}, not [{self.n_res}, {y.size}]")
        return J

    def _differences(self, y, target):
        J = np.empty((self.n_res, y.size))
        for j in range(y.size):
            h = _STEP * max(1.0, abs(y[j])) if np.isfinite(y[j]) else 1.0
            above, below = y.copy(), y.copy()
            above[j] += h
            below[j] -= h
            J[:, j] = (self.residual(above, target.copy()) - self.residual(below, target.copy())) / (2 * h)
        return np.where(np.isfinite(J), J, 0.0)


class _Served:
    """The costs of one configuration, as the library sees them; lives as long as it."""

    def __init__(self, costs):
        self.costs = dict(costs)
        self.cause = None  # the first exception of a cost
        for name, cost in self.costs.items():
            if not isinstance(cost, Cost):
                raise TypeError(f"functions: '{name}' is no myohorizon.Cost")
        self.handles = {name: ffi.new_handle((self, _Bound(cost))) for name, cost in self.costs.items()}
        self.ops = ffi.new("mhe_cost_ops *", {"size": ffi.sizeof("mhe_cost_ops"), "layout": _layout,
                                              "residual": _residual, "jacobian": _jacobian})
        self.handle = ffi.new_handle(self)
        self.own = ffi.new("mhe_own_costs *", {"size": ffi.sizeof("mhe_own_costs"), "data": self.handle, "find": _find})
        self.service = ffi.callback("python_service", lambda _host, id: self.own
                                    if text(id) == texts["MHE_OWN_COSTS_SERVICE"] else ffi.NULL)

    def guarded(self, err, work):
        try:
            work()
            return 0
        except BaseException as exception:
            if self.cause is None:
                self.cause = exception
            if err != ffi.NULL:
                line = traceback.format_exception_only(type(exception), exception)[-1].strip()
                data = ("a cost in Python: " + line).encode()[:700]
                ffi.buffer(err.text)[:len(data) + 1] = data + b"\0"
                err.code = lib.MHE_E_NUMERIC
            return lib.MHE_E_NUMERIC


@ffi.callback("python_find")
def _find(own, name, out):
    served = ffi.from_handle(own.data)
    handle = served.handles.get(text(name))
    if handle is None:
        return ffi.NULL
    out[0] = handle
    return served.ops


def _numbers(pointer, n):
    return np.frombuffer(ffi.buffer(pointer, 8 * n)).copy() if n > 0 else np.empty(0)


@ffi.callback("python_layout")
def _layout(self, problem, out, err):
    served, bound = ffi.from_handle(ffi.cast("void *", self))
    cost = bound.cost

    def work():
        n, size = 0, ffi.new("int32_t *")
        out.n_signals = len(cost.signals)
        for i, (name, at) in enumerate(cost.signals):
            out.signals[i] = problem.find_signal(problem, encode(name), size, ffi.NULL)
            if out.signals[i] < 0:
                raise ValueError(f"the problem has no signal '{name}'")
            out.at[i] = AT[at]
            n += size[0]
        bound.n_res = out.n_res = n if cost.n_res is None else cost.n_res
        out.jacobian = lib.MHE_JACOBIAN_DENSE
        out.res_unit = cost._unit
        out.fills_missing = int(cost.fills_missing)

    return served.guarded(err, work)


@ffi.callback("python_evaluate")
def _residual(self, stage, r, err):
    served, bound = ffi.from_handle(ffi.cast("void *", self))

    def work():
        n = stage.ny
        values = bound.residual(_numbers(stage.y, n), _numbers(stage.y_ref, n))
        ffi.memmove(r, np.ascontiguousarray(values), values.nbytes)

    return served.guarded(err, work)


@ffi.callback("python_evaluate")
def _jacobian(self, stage, J, err):
    served, bound = ffi.from_handle(ffi.cast("void *", self))

    def work():
        n = stage.ny
        values = np.ascontiguousarray(bound.jacobian(_numbers(stage.y, n), _numbers(stage.y_ref, n)))
        ffi.memmove(J, values, values.nbytes)

    return served.guarded(err, work)


def serve(costs):
    """The service that hands `costs` to the library, and what must be kept while it may ask."""
    if not costs:
        return None, None
    served = _Served(costs)
    return served.service, served
