# SPDX-License-Identifier: Apache-2.0
"""What a user gets wrong is an exception that says what would be right; the estimator goes on afterwards."""
import copy
import itertools
import pickle
import threading
import time

import numpy as np
import pytest
from support import DEMO, FAST, demo_frames

import myohorizon
import myohorizon.estimator as module
from myohorizon import ArgumentError, ClosedError, ConfigError, Error, InputError, PluginError, ThreadError


@pytest.fixture
def estimator():
    with myohorizon.Estimator(DEMO, **FAST) as e:
        yield e


def goes_on(estimator, begin=100.0):
    got = [estimator.push(t + begin, m, e) for t, m, e in demo_frames(25)]  # the window is full at 22
    assert any(x is not None for x in got)


@pytest.mark.parametrize("markers, kind, message", [
    (np.zeros((7, 3)), ArgumentError, r"markers: the shape is \[7, 3\]; this model takes \[8, 3\].*DELT"),
    (np.zeros((3, 8)), ArgumentError, "shape"),
    (np.zeros(24), ArgumentError, "shape"),
    (np.zeros((8, 3, 1)), ArgumentError, "shape"),
    (np.zeros((0,)), ArgumentError, "shape"),
    (1.0, ArgumentError, "shape"),
    ([[1, 2, 3], [4, 5]], ArgumentError, "markers"),
    (np.zeros((8, 3), complex), TypeError, "complex128"),
    (np.zeros((8, 3), bool), TypeError, "bool"),
    (np.full((8, 3), "x"), TypeError, "numbers are needed"),
    (np.full((8, 3), None), TypeError, "object"),
    ("markers", TypeError, "numbers are needed"),
    (object(), TypeError, "object"),
    ({"ELBOW": (0, 0, 0)}, ArgumentError, "the model has no 'ELBOW'; it has DELT"),
    ({"DELT": (0, 0)}, ArgumentError, "DELT"),
    ({"DELT": "abc"}, ArgumentError, "DELT"),
])
def test_markers(estimator, markers, kind, message):
    with pytest.raises(kind, match=message):
        estimator.push(0.0, markers, np.zeros(19))
    goes_on(estimator)


def test_emg_and_angles(estimator):
    with pytest.raises(ArgumentError, match=r"emg: the shape is \[18\]"):
        estimator.push(0.0, None, np.zeros(18))
    with pytest.raises(ArgumentError, match=r"angles: the shape is \[5\]"):
        estimator.push(0.0, None, None, np.zeros(5))
    goes_on(estimator)


@pytest.mark.parametrize("t", ["now", None, [1.0], 1j])
def test_a_time_that_is_none(estimator, t):
    with pytest.raises(TypeError):
        estimator.push(t, None, None)
    goes_on(estimator)


@pytest.mark.parametrize("t", [float("nan"), float("inf"), -float("inf")])
def test_a_time_that_is_not_finite(estimator, t):
    with pytest.raises(ArgumentError):
        estimator.push(t, None, None)
    goes_on(estimator)


def test_times_must_increase(estimator):
    estimator.push(1.0)
    with pytest.raises(ArgumentError, match="does not follow"):
        estimator.push(1.0)
    with pytest.raises(ArgumentError):
        estimator.push(0.999)


def test_numbers_that_are_none_are_never_believed(estimator):
    frames = demo_frames(40)
    for n, bad in enumerate((np.nan, np.inf, -np.inf, 1e300, 1e-320)):
        begin = 10 * (n + 1)
        for k, (t, markers, emg) in enumerate(frames):
            markers, emg = markers.copy(), emg.copy()
            markers[k % 8, k % 3] = bad
            emg[k % 19] = bad
            try:
                estimate = estimator.push(begin + t, markers, emg)
            except Error:
                continue
            if estimate is not None:
                assert all(np.isfinite(values).all() for values in estimate.values())
    goes_on(estimator, 1000.0)


def test_used_after_close():
    estimator = myohorizon.Estimator(DEMO, **FAST)
    last = [e for e in (estimator.push(*frame) for frame in demo_frames(40)) if e is not None][-1]
    estimator.close()
    estimator.close()
    assert np.isfinite(last.force).all()  # an estimate outlives its estimator
    assert estimator.closed and "closed" in repr(estimator)
    assert len(estimator.muscle_names) == 19
    for use in (lambda: estimator.push(0.0), estimator.prepare, lambda: estimator.window, lambda: estimator.phase,
                lambda: estimator.config, lambda: estimator.channels, lambda: estimator.dropped, estimator.tracked,
                lambda: estimator.measure("emg", 0, np.zeros(19)), lambda: estimator.open_emg(["a"], 1000),
                lambda: estimator.push_emg(0.0, [1.0]), lambda: estimator.set_node(0), lambda: estimator.set_start(),
                lambda: estimator.set_deadline(1), lambda: estimator.emg_lag, estimator.__enter__):
        with pytest.raises(ClosedError):
            use()
    estimator.stop()  # nothing to stop


class Between:
    """The library, with work of the test's own between the call of a push and the push itself."""

    def __init__(self, library, work):
        self._library, self._work = library, work

    def __getattr__(self, name):
        return getattr(self._library, name)

    def mhe_estimator_push(self, *arguments):
        self._work()
        return self._library.mhe_estimator_push(*arguments)


def between(monkeypatch, work):
    monkeypatch.setattr(module, "lib", Between(module.lib, work))


def test_two_threads(estimator, monkeypatch):
    """The second is refused while the first is at work; the work of the first goes on."""
    tried = []

    def use():
        for name in ("prepare", "tracked", "push"):
            try:
                getattr(estimator, name)(*[1e6][:name == "push"])
                tried.append(None)
            except Exception as error:
                tried.append(error)

    def work():
        other = threading.Thread(target=use)
        other.start()
        other.join()

    between(monkeypatch, work)
    done = sum(estimator.push(*frame) is not None for frame in demo_frames(60))
    assert done > 5
    assert len(tried) == 180 and all(type(error) is ThreadError for error in tried)


def test_closed_by_another_thread(estimator, monkeypatch):
    """close() waits for the push that is at work, and is not kept waiting by the pushes that follow: they are refused."""
    frames = demo_frames(200)
    closer = threading.Thread(target=estimator.close)

    def work():
        if len(got) < 60:
            return
        closer.start()
        while True:  # close() is on its way, and the push is still there
            try:
                estimator.prepare()
                raise AssertionError("two at one estimator")
            except ThreadError:
                time.sleep(0.001)
            except ClosedError:
                break
        assert closer.is_alive() and not estimator.closed

    got = []
    between(monkeypatch, work)
    with pytest.raises(ClosedError):
        for frame in frames:
            got.append(estimator.push(*frame))
    closer.join()
    assert estimator.closed
    assert len(got) == 61 and sum(x is not None for x in got) > 5


def test_within_its_own_push(estimator, monkeypatch):
    """A cost in Python or a signal's handler that closes or uses the estimator is refused, and does not wait for itself."""
    def work():
        for use in (estimator.close, estimator.prepare, lambda: estimator.push(0.0)):
            with pytest.raises(ThreadError, match="this very thread"):
                use()

    between(monkeypatch, work)
    estimator.push(*demo_frames(1)[0])
    monkeypatch.undo()
    goes_on(estimator)


def test_stopped_by_another_thread():
    frames = demo_frames()
    with myohorizon.Estimator(DEMO) as estimator:
        timer = threading.Timer(0.1, estimator.stop)
        timer.start()
        with pytest.raises(myohorizon.Interrupted):
            for k in itertools.count():
                for t, markers, emg in frames:
                    estimator.push(t + 10 * k, markers, emg)
        timer.join()


def test_other_threads_run_while_the_library_works(monkeypatch):
    """The interpreter's lock is released: another thread counts on between the call of a push and its return."""
    counted, during = [0], []
    stop = threading.Event()
    real = module.lib

    class Watched(Between):
        @staticmethod
        def mhe_estimator_push(*arguments):
            before = counted[0]
            status = real.mhe_estimator_push(*arguments)
            during.append(counted[0] - before)
            return status

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0)
    seen = 0
    with myohorizon.Estimator(DEMO, **{"horizon.window": 30}) as estimator:
        monkeypatch.setattr(module, "lib", Watched(real, None))
        thread = threading.Thread(target=count)
        thread.start()
        frames = demo_frames()
        for k in range(20):  # the processor may have been others' for a while: then again
            for t, markers, emg in frames:
                estimator.push(t + 10 * k, markers, emg)
                seen = sum(n > 3 for n in during)  # a lock that changes hands before and after gives one or two
                if seen > 3:
                    break
            if seen > 3:
                break
        stop.set()
        thread.join()
        monkeypatch.undo()
    assert seen > 3


def test_configs(tmp_path):
    with pytest.raises(InputError, match="cannot be opened") as caught:
        myohorizon.Estimator(tmp_path / "none.yaml")
    assert caught.value.file == str(tmp_path / "none.yaml") and caught.value.line is None
    bad = tmp_path / "bad.yaml"
    bad.write_text("model: {file: arm19.osim}\nhorizon:\n  windw: 3\n")
    with pytest.raises(ConfigError, match="windw.*did you mean 'window'") as caught:
        myohorizon.Estimator(bad)
    assert caught.value.file == str(bad) and caught.value.line == 3
    with pytest.raises(PluginError, match="mhe.cost.none"):
        myohorizon.Estimator(DEMO, costs=["mhe.cost.none"])
    with pytest.raises(ConfigError, match="windw"):
        myohorizon.Estimator(DEMO, horizon__windw=3)
    with pytest.raises(ConfigError):
        myohorizon.Estimator(DEMO, horizon__window=1)
    with pytest.raises(TypeError, match="path, a dict, or a text"):
        myohorizon.Estimator(12)
    with pytest.raises(TypeError, match="has no form in a configuration"):
        myohorizon.Estimator({"model": object()})
    with pytest.raises(ValueError):
        myohorizon.Estimator({"model": {"file": "x"}, "data": {"emg_offset": float("nan")}})
    with pytest.raises(ValueError, match="NUL"):
        myohorizon.Estimator("a\0b.yaml")
    with pytest.raises(TypeError, match="a file has its own"):
        myohorizon.Estimator(DEMO, folder="/tmp")
    with pytest.raises(Error):
        myohorizon.Estimator("")
    with pytest.raises(Error):
        myohorizon.Estimator(tmp_path)
    untrusted = tmp_path / "plugins.yaml"
    untrusted.write_text(f"plugin_path: [{tmp_path}]\nmodel: {{file: {DEMO.parent}/arm19.osim}}\n"
                         "costs: [mhe.cost.min-excitation]\n")
    with pytest.raises(Error, match="plugin_path"):
        myohorizon.Estimator(untrusted)
    myohorizon.Estimator(untrusted, trust=True).close()


def test_raw_emg_and_nodes(estimator):
    with pytest.raises(ArgumentError, match=r"open_emg\(columns, rate\) comes first"):
        estimator.push_emg(0.0, [1.0])
    with pytest.raises(TypeError, match="list of names"):
        estimator.open_emg("Biceps", 2000)
    with pytest.raises(Error):
        estimator.open_emg(["Biceps"], 2000)  # the config has no channels
    with pytest.raises(ArgumentError):
        estimator.set_node(99)
    with pytest.raises(ArgumentError):
        estimator.set_deadline(-1)
    with pytest.raises(ArgumentError, match=r"\[19\]"):
        estimator.measure("emg", 0.0, np.zeros(3))
    with pytest.raises(ArgumentError, match="the model has no 'elbow'"):
        estimator.set_start(q={"elbow": 1})
    with pytest.raises(OverflowError):
        estimator.set_node(2 ** 40)
    goes_on(estimator)


def test_not_copied(estimator):
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="not to be pickled or copied"):
            make(estimator)


def test_half_made():
    """An object whose __init__ never ran, or failed, goes quietly."""
    estimator = myohorizon.Estimator.__new__(myohorizon.Estimator)
    del estimator
    live = myohorizon.Live.__new__(myohorizon.Live)
    del live
    with pytest.raises(Error, match="sources"):
        myohorizon.Live(DEMO)
