#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""models/abduction/stability.yaml on the raised part of its recording: does the humeral head stay in its socket, do muscles
hold the girdle, and is the model that person.py writes the one of the file? And does the head stay there in the thoracoscapular
model (a loop, paths that wrap), on a motion made up: the arm raised by 66 degrees and lowered within 8 s?

    shoulder.py PATH/mhe-run PATH/mhe-model SOURCE_DIR     status 77: the data are not there
    shoulder.py PATH/mhe-run PATH/mhe-model SOURCE_DIR whole     the made up motion as a whole, paths fitted, with its rate
"""
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

FIRST, LAST = 260, 420  # frames: from 50 degrees to the top and down


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def cut(source, target):
    """The recording's markers from FIRST to LAST, with their times."""
    lines = source.read_text().splitlines()
    head, rows = lines[:5], [line for line in lines[5:] if line.strip()]
    rows = rows[FIRST:LAST]
    words = head[2].split("\t")
    words[2] = str(len(rows))
    head[2] = "\t".join(words)
    target.write_text("\n".join(head + rows) + "\n")


def evaluated(model, poses, mhe_model):
    return json.loads(run(mhe_model, "evaluate", model, "--poses", poses))["poses"]


def same_model(mhe_model, person, data, folder):
    """Markers and paths of the .osim as it is are those of the .bioMod."""
    run(sys.executable, "-B", person, data / "wu_scaled.bioMod", folder / "same.osim", "--as-it-is")
    free = json.loads(run(mhe_model, "info", folder / "same.osim", "--json"))["coordinates"]
    names = [c["name"] for c in free]
    assert len(names) == 10, names
    poses = [{"q": {n: 0.1 * ((7 * k + 3 * i) % 11 - 5) for i, n in enumerate(names)}} for k in range(4)]
    (folder / "poses.json").write_text(json.dumps({"poses": poses}))
    worst = 0
    for a, b in zip(*(evaluated(m, folder / "poses.json", mhe_model) for m in (data / "wu_scaled.bioMod", folder / "same.osim"))):
        assert len(b["markers"]) == 12 and len(b["lines"]) == 31
        for name, at in b["markers"].items():
            worst = max(worst, *(abs(x - y) for x, y in zip(at, a["markers"][name])))
        for name, line in b["lines"].items():
            worst = max(worst, abs(line["length"] - a["lines"][name]["length"]))
    print(f"person.py as it is: places and lengths within {worst:.1e} m")
    assert worst < 1e-8


# ---- the thoracoscapular model ----

def made_up(mhe_model, model, frames, folder):
    """Markers (m.trc) and joint angles (m.sto) of the raised arm at these frames, 100 a second."""
    poses = []
    for k in frames:
        share = 0.5 - 0.5 * math.cos(2 * math.pi * k / 800)
        poses.append({"q": {"shoulder_elv": 0.32 + 1.15 * share, "plane_elv": 0.3 * share}})
    (folder / "m.json").write_text(json.dumps({"poses": poses}))
    answers = evaluated(model, folder / "m.json", mhe_model)
    names, angles = list(answers[0]["markers"]), list(answers[0]["q"])
    with open(folder / "m.trc", "w") as f:
        f.write("PathFileType\t4\t(X/Y/Z)\tm.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
                f"OrigDataStartFrame\tOrigNumFrames\n100\t100\t{len(poses)}\t{len(names)}\tm\t100\t1\t{len(poses)}\nFrame#\tTime\t"
                + "\t\t\t".join(names) + "\n\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, len(names) + 1)) + "\n\n")
        for k, a in enumerate(answers):
            f.write(f"{k + 1}\t{k / 100:.2f}\t" + "\t".join("%.6f" % v for n in names for v in a["markers"][n]) + "\n")
    with open(folder / "m.sto", "w") as f:
        f.write(f"m\nversion=1\nnRows={len(poses)}\nnColumns={1 + len(angles)}\ninDegrees=no\nendheader\n"
                + "\t".join(["time", *angles]) + "\n")
        for k, a in enumerate(answers):
            f.write("\t".join("%.8g" % v for v in [k / 100, *(a["q"][n] for n in angles)]) + "\n")


HELD = """formulation: activation
model: {file: %s%s}
muscle: {curves: degroote2016, passive: 0}
data: {markers: m.trc}
horizon: {window: 7, ratio: 1}
bounds: {residual_torques: true, residual_torque_max: 50}
solver: {plugin: mhe.solver.rti, preset: %s}
costs:
  - {plugin: mhe.cost.track, signal: markers, nodes: running, sigma: 0.005, weight: 100, huber: 4}
  - {plugin: mhe.cost.track, signal: markers, nodes: last, sigma: 0.005, huber: 4}
  - {plugin: mhe.cost.track, signal: activation, value: [0], sigma: 0.5, weight: 100}
  - plugin: mhe.cost.track
    signal: residual_torque
    value: [0]
    sigma: 50
    weight: 100
    of: [ground_thorax_rot_x, ground_thorax_rot_y, ground_thorax_rot_z]
  - plugin: mhe.cost.track
    signal: residual_torque
    value: [0]
    sigma: 1
    weight: 100
    of: [clav_prot, clav_elev, scapula_abduction, scapula_elevation, scapula_upward_rot, scapula_winging, plane_elv,
      shoulder_elv, axial_rot]
  - {plugin: mhe.cost.track, signal: qdot, value: [0], nodes: running, sigma: 5, weight: 100}
  - {plugin: mhe.cost.track, signal: qdot, value: [0], nodes: last, sigma: 1}
"""
CONE = """  - plugin: mhe.cost.joint-stability
    joint: GlenoHumeral
    axis: [0.569, -0.220, 0.792] # markers ts to gu
    angle: 0.42
    sigma: 5
    weight: 100
"""


def thoracoscapular(mhe_run, mhe_model, model, figures, whole, folder):
    """Share of frames within 30 degrees, without and with the cost."""
    made_up(mhe_model, model, range(801) if whole else range(150, 185), folder)
    paths, preset = (", paths: fitted, motion: m.sto", "speed") if whole else ("", "balanced")
    shares = []
    for name, more in (("without", ""), ("with", CONE)):
        (folder / f"{name}.yaml").write_text(HELD % (model, paths, preset) + more)
        run(mhe_run, folder / f"{name}.yaml", "--out", folder / name, "--quiet", "--set", "output.reactions=parent")
        _, angles = figures.reaction(folder / name, "GlenoHumeral", (0.569, -0.220, 0.792))
        shares.append(sum(a <= 30 for a in angles) / len(angles))
        rate = json.loads((folder / name / "summary.json").read_text())["rate_hz"]["mean"]
        print(f"thoracoscapular, {name} the cost: {100 * shares[-1]:.1f} % of {len(angles)} frames within 30 deg, at most "
              f"{max(angles):.1f}" + (f"; {rate:.0f} estimates a second" if whole else ""))
    return shares


def main():
    mhe_run, mhe_model, source, whole = sys.argv[1], sys.argv[2], Path(sys.argv[3]), "whole" in sys.argv[4:]
    shared = Path(os.environ.get("MHE_SHARED", source / "../shared")) / "data"
    data, thorax = shared / "abduction", shared / "opensim/ThoracoscapularShoulderModel.osim"
    if not (data / "abd_markers.trc").is_file() or not thorax.is_file():
        sys.exit(77)
    models = source / "models/abduction"
    sys.path.insert(0, str(models))
    sys.dont_write_bytecode = True
    import figures
    with tempfile.TemporaryDirectory() as name:
        without, held = thoracoscapular(mhe_run, mhe_model, thorax.resolve(), figures, whole, Path(name))
    assert without < 0.5 and held > 0.9, (without, held)
    if whole:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "abduction").mkdir()
        same_model(mhe_model, models / "person.py", data, folder)
        run(sys.executable, "-B", models / "person.py", data / "wu_scaled.bioMod", folder / "abduction/person.osim")
        (folder / "abduction/abd_emg_raw.sto").symlink_to((data / "abd_emg_raw.sto").resolve())
        cut(data / "abd_markers.trc", folder / "abduction/abd_markers.trc")
        (folder / "stability.yaml").write_text((models / "stability.yaml").read_text())
        run(mhe_run, folder / "stability.yaml", "--out", folder / "out", "--quiet", "--set", "output.reactions=parent")
        seen = figures.figures(folder / "out")
    print(json.dumps(seen, indent=1))
    assert seen["frames"] == LAST - FIRST - 7 and seen["loaded"] > 0.9
    assert seen["within_30"] >= 0.9
    assert max(seen["residuals"].values()) < 5
    assert all(a > 1e-3 for of in seen["girdle"].values() for a in of.values())
    for group in ("serratus", "rhomboids", "trapezius"):
        assert max(seen["girdle"][group].values()) > 0.05, group


if __name__ == "__main__":
    main()
