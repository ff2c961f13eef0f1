# SPDX-License-Identifier: Apache-2.0
"""Frame by frame: what comes out, under which names, and that it is what C gives, to the bit."""
import os
import subprocess
import time

import numpy as np
import pytest
from support import BUILD, DEMO, FAST, SOURCE, demo_frames, short_demo

import myohorizon
from myohorizon._library import path as library_path


def estimates(frames, **keys):
    with myohorizon.Estimator(DEMO, **{**FAST, **keys}) as estimator:
        return [e for e in (estimator.push(*frame) for frame in frames) if e is not None]


def test_an_estimate_has_names_units_and_copies():
    frames = demo_frames(60)
    with myohorizon.Estimator(DEMO, **FAST) as estimator:
        assert estimator.phase == "empty"
        assert estimator.push(*frames[0]) is None
        got = []
        for frame in frames[1:]:
            estimate = estimator.push(*frame)
            if estimate is not None:
                got.append(estimate)
                tracked = estimator.tracked()
            else:
                assert estimator.tracked() == {}
        assert estimator.phase in ("settling", "running")
        assert estimator.interval == pytest.approx(0.03)
        last = got[-1]
        assert set(last) == {"q", "qdot", "activation", "excitation", "force", "moment", "markers"}
        assert last.force.shape == (19,) and last["markers"].shape == (8, 3) and last.q.dtype == np.float64
        assert last.labels("force") == estimator.muscle_names and last.units["force"] == "N"
        assert last.named("force")["BRA"] == last.force[estimator.muscle_names.index("BRA")]
        assert last.status in ("ok", "iteration_limit") and last.solve_time > 0
        assert not np.array_equal(got[0].force, last.force)  # copies, not the estimator's memory
        last.force[:] = -1
        assert tracked["markers"]["columns"][0] == "DELT.x" and tracked["markers"]["rms"] < 1e-3
        assert set(tracked["emg"]["why"]) == {"used"}
        with pytest.raises(AttributeError, match="it has q, qdot"):
            last.forces


def test_standard_deviations_come_where_they_are_asked_for():
    frames = demo_frames(60)
    plain, sure = estimates(frames), estimates(frames, **{"output.uncertainty": True})
    assert "force_sd" not in plain[-1] and np.array_equal(plain[-1].force, sure[-1].force)
    assert sure[-1].force_sd.shape == (19,) and (sure[-1].force_sd > 0).all()
    assert sure[-1].q_sd.shape == (4,) and np.isfinite(sure[-1].moment_sd).all()
    assert sure[-1].labels("activation_sd") == sure[-1].labels("force")


def test_reactions_come_where_they_are_asked_for(tmp_path):
    """Those that mhe-run writes."""
    frames = demo_frames(40)
    last = estimates(frames, **{"output.reactions": "child"})[-1]
    assert last.reactions.shape == (len(last.labels("reactions")), 6) and np.abs(last.reactions).max() > 1
    keys = short_demo(tmp_path, 40)
    results = myohorizon.run(DEMO, **FAST, **keys, output__reactions="child")
    table = results.table("reactions")
    assert table.columns[0].endswith("_fx") and np.array_equal(table.values[len(table) - 1], last.reactions.ravel())
    words = [word for key, value in {**FAST, **keys, "output.reactions": "child", "output.picture": "false"}.items()
             for word in ("--set", f"{key}={value}")]
    subprocess.run([BUILD / "bin/mhe-run", DEMO, "--out", tmp_path / "out", "--quiet", *words], check=True, capture_output=True)
    written = myohorizon.read_sto(tmp_path / "out/reactions.sto")
    assert written.columns == table.columns and np.allclose(written.values, table.values, rtol=1e-11, atol=0)


def test_the_bits_are_those_of_c(tmp_path):
    """examples/stream with every digit, built against the same library."""
    source = (SOURCE / "examples/stream/stream.c").read_text()
    assert "%.3f" in source and "%.1f" in source
    (tmp_path / "stream.c").write_text(source.replace("%.3f", "%a").replace(" %.1f", " %a"))
    program = tmp_path / "stream"
    flags = ["-fsanitize=" + os.environ["MHE_SANITIZE"]] if os.environ.get("MHE_SANITIZE") else []
    subprocess.run([os.environ["MHE_C_COMPILER"], "-std=c11", "-D_POSIX_C_SOURCE=200809L", *flags, f"-I{SOURCE}/core/include",
                    f"-I{BUILD}/core/include", str(tmp_path / "stream.c"), "-o", str(program), library_path,
                    f"-Wl,-rpath,{os.path.dirname(os.path.realpath(library_path))}"], check=True)
    environment = {key: value for key, value in os.environ.items() if key != "LD_PRELOAD"}
    done = subprocess.run([str(program), str(DEMO), "solver.plugin=mhe.solver.rti"], check=True, capture_output=True,
                          text=True, env=environment)
    of_c = np.array([[float.fromhex(number) for number in line.split()] for line in done.stdout.splitlines()])
    ours = []
    recorded = demo_frames()
    with myohorizon.Estimator(DEMO, **FAST) as estimator:
        for frame in recorded:
            estimate = estimator.push(*frame)
            if estimate is not None:
                ours.append([estimate.time, *estimate.force])
            estimator.prepare()
    ours = np.array(ours)
    assert ours.shape == of_c.shape and len(ours) > 80
    assert np.array_equal(ours, of_c)


def test_names_other_types_and_orders_give_the_same():
    frames = demo_frames(40)
    plain = estimates(frames)
    with myohorizon.Estimator(DEMO) as estimator:
        markers, muscles = estimator.marker_names, estimator.muscle_names
    by_name = [(t, {name: m[i] for i, name in enumerate(markers)}, {name: e[i] for i, name in enumerate(muscles)})
               for t, m, e in frames]
    others = [(t, np.asfortranarray(m), e.tolist()) for t, m, e in frames]
    strided = [(np.float64(t), np.repeat(m, 2, axis=0)[::2], np.repeat(e, 3)[::3]) for t, m, e in frames]
    for variant in (by_name, others, strided):
        assert all(np.array_equal(a.force, b.force) for a, b in zip(plain, estimates(variant), strict=True))


def test_masked_values_are_missing():
    frames = demo_frames(40)
    with_nan = [(t, np.where(np.arange(8)[:, None] == 2, np.nan, m), e) for t, m, e in frames]
    masked = [(t, np.ma.array(m, mask=np.repeat(np.arange(8)[:, None] == 2, 3, axis=1)), e) for t, m, e in frames]
    a, b = estimates(with_nan), estimates(masked)
    assert all(np.array_equal(x.force, y.force) for x, y in zip(a, b, strict=True))


def test_missing_frames_and_late_measurements():
    frames = demo_frames(60)
    with myohorizon.Estimator(DEMO, **FAST) as estimator:
        last = None
        for k, (t, markers, emg) in enumerate(frames):
            estimate = estimator.push(t, markers, None)
            estimator.measure("emg", t, emg)  # after its frame
            last = estimate or last
        assert last is not None and last.emg_rms < 0.1
        with pytest.raises(myohorizon.ArgumentError, match="there is no channel 'forces'; there are markers, emg"):
            estimator.measure("forces", 0.1, np.zeros(19))


def test_raw_emg():
    markers, signals = myohorizon.read_c3d(DEMO.parent / "demo_recording.c3d")
    with myohorizon.Estimator(DEMO.parent / "demo_raw.yaml", **FAST) as estimator:
        estimator.open_emg(signals.columns, 2000)
        order = [markers.labels.index(name) for name in estimator.marker_names]
        frames = markers.values.reshape(len(markers), -1, 3)[:, order]
        begin, got = 0, []
        for k, t in enumerate(markers.time[:80].tolist()):
            end = int(np.searchsorted(signals.time, t, side="right"))
            estimator.push_emg(signals.time[begin:end], signals.values[begin:end])
            begin = end
            estimate = estimator.push(t, frames[k])
            if estimate is not None:
                got.append(estimate)
        assert 0 < estimator.emg_lag < 0.1
        assert got and not np.isnan(got[-1].emg_rms)


def test_a_config_may_be_a_dict_or_a_text():
    model = {"file": "arm19.osim"}
    content = {"model": model, "costs": ["mhe.cost.min-excitation"], "horizon": {"window": 5}}
    with myohorizon.Estimator(content, folder=DEMO.parent) as a:
        assert a.window == 5 and "window: 5" in a.config
    text = "model: {file: arm19.osim}\ncosts: [mhe.cost.min-excitation]\n"
    with myohorizon.Estimator(text, folder=str(DEMO.parent), horizon__window=6) as b:
        assert b.window == 6
    with myohorizon.Estimator(DEMO, horizon={"window": 4}) as c:
        assert c.window == 4


def test_push_costs_less_than_25_us(monkeypatch):
    """The binding's share: everything but the estimation itself, whose call another one of the library stands for."""
    if os.environ.get("MHE_SANITIZE"):
        pytest.skip("times under a sanitizer mean nothing")
    import myohorizon.estimator as module
    frames = demo_frames(30)
    with myohorizon.Estimator(DEMO, **FAST, **{"horizon.ratio": 1}) as estimator:
        for frame in frames[:-1]:
            estimator.push(*frame)
        counts = module.ffi.new("mhe_channel_counts *", {"size": module.ffi.sizeof("mhe_channel_counts")})
        real = module.lib

        class Instead:
            def __getattr__(self, name):
                return getattr(real, name)

            @staticmethod
            def mhe_estimator_push(pointer, *_):
                return real.mhe_estimator_counts(pointer, 0, counts)

        monkeypatch.setattr(module, "lib", Instead())
        estimator._ready[0] = 1
        best, n = 1.0, 2000
        for _ in range(5):
            begin = time.process_time()
            for _ in range(n):
                estimator.push(*frames[-1])
            best = min(best, (time.process_time() - begin) / n)
        assert best < 25e-6
