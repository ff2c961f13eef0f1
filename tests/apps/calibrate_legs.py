#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mhe-calibrate on a large model: the legs of gait2392, 92 muscles, two simulated swings of 1.1 s, 184 parameters.

    calibrate_legs.py PATH/mhe-calibrate PATH/mhe-sim SOURCE_DIR     by hand; status 77: the model is not there

Pelvis and trunk stand still, nothing touches the ground. Strengths are off by 30 %. What counts is that it converges, that markers,
angles and forces are then nearer to the truth, and that most of the ten minutes that it may take are left.
"""
import json
import math
import os
import random
import re
import subprocess
import sys
import tempfile

CALIBRATE, SIM, SOURCE = (os.path.abspath(path) for path in sys.argv[1:4])
LOCKED = ["pelvis_" + a for a in ("tilt", "list", "rotation", "tx", "ty", "tz")] + ["lumbar_" + a for a in (
    "extension", "bending", "rotation")] + [a + s for s in ("_r", "_l") for a in ("subtalar_angle", "mtp_angle")]
BASE = """model: {file: %%s, unsupported: warn, locked: [%s]}
muscle: {curves: degroote2016}
bounds: {residual_torques: true}
horizon: {window: 7, ratio: 3}
""" % ", ".join(LOCKED)


def write(name, text):
    with open(name, "w") as file:
        file.write(text)


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


def excitations(names):
    """Flexors and lifters of the feet by turns, the others at random, extensors of the knee hardly."""
    r, rows = random.Random(3), []
    phase = [(r.uniform(0, 2 * math.pi), r.uniform(0.01, 0.03)) for _ in names]
    for k in range(221):
        row = [0.01 * k]
        for name, (p, a) in zip(names, phase):
            extends, flexes = (any(part in name for part in parts) for parts in (
                ("vas_", "rect_fem"), ("bifem", "semi", "sar", "grac")))
            side = 0 if name.endswith("_r") else math.pi
            wave = 0.5 * (1 + math.sin(2 * math.pi * row[0] / 1.1 + side + (0 if flexes else p)))
            row.append(0.01 + wave * (0.015 if extends else 0.08 if flexes else 0.12 if "tib_ant" in name or "ext_" in name else a))
        rows.append("\t".join("%.5f" % x for x in row))
    write("excitations.sto", "excitations\nnRows=221\nnColumns=%d\ninDegrees=no\nendheader\ntime\t%s\n%s\n" % (
        len(names) + 1, "\t".join(names), "\n".join(rows)))


def main():
    path = os.path.join(os.environ.get("MHE_SHARED", os.path.join(SOURCE, "..", "shared")), "data", "walking", "gait2392",
                        "subject01_simbody.osim")
    if not os.path.exists(path):
        return 77
    with open(path) as file:  # knees that bend both ways: none is at its end of range
        text, n_knees = re.subn(r"<range>\s*-2\.0943\d* 0\.1745\d*\s*</range>", "<range>-2.0943951 2.3</range>", file.read())
    assert n_knees == 2, n_knees
    names = re.findall(r'<\w*Muscle\w* name="([^"]+)"', text)
    assert len(names) == 92, len(names)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        r = random.Random(5)
        write("legs.osim", text)
        write("wrong.osim", re.sub(r"(<max_isometric_force>)([^<]+)", lambda m: m.group(1) + "%.8g" % (
            float(m.group(2)) * math.exp(0.3 * max(-2, min(2, r.gauss(0, 1))))), text))
        excitations(names)
        write("sim.yaml", BASE % "legs.osim" + "costs: [mhe.cost.min-excitation]\n")
        run(SIM, "forward", "sim.yaml", "--input", "excitations.sto", "--out", "sim")
        write("legs.yaml", BASE % "wrong.osim" + """costs: [{plugin: mhe.cost.emg-markers, markers: 0.001, emg_spread: 0.1, residual_torque: 0.1}]
data: {markers: sim/markers.trc, emg: sim/emg.sto, reference: sim/reference.sto}
solver: {plugin: mhe.solver.rti, preset: robust}
calibrate:
  parameters: [{name: max_isometric_force, sd: 0.3}, {name: emg_gain, sd: 0.2}]
""")
        run(CALIBRATE, "legs.yaml", "--out", "out", "--quiet")
        with open("out/calibration.json") as file:
            told = json.load(file)
        before, after = told["recordings"][0]["before"], told["recordings"][0]["after"]
        print("%d parameters, %d iterations, %.1f s of processor; forces %.1f -> %.1f N, angles %.3f -> %.3f deg" % (
            len(told["parameters"]), told["iterations"], told["processor_seconds"], before["force_n"], after["force_n"],
            before["q_deg"], after["q_deg"]))
        assert told["outcome"] == "converged" and len(told["parameters"]) == 184, told["outcome"]
        assert after["force_n"] < 0.6 * before["force_n"] and after["q_deg"] < 0.1 * before["q_deg"], (before, after)
        assert told["processor_seconds"] < 600, told["processor_seconds"]
    return 0


if __name__ == "__main__":
    sys.exit(main())
