#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What calibration is worth where the model is wrong: docs/study.md, "A wrong model, calibrated".

    mismatch.py BIN_DIR OUT [--draws 1-10] [--conditions exact,noise,insertions,markers]

Makes four motions of arm19 with co-contraction (mhe-sim reference; 40 s), three to learn from and one held out. Each draw then
spoils the model and the EMG, mhe-calibrate starts from the spoilt ones, and a line tells the forces of the held-out motion before
and after. Seeds are the draws' numbers.
"""
import argparse
import json
import math
import os
import random
import re
import subprocess

ARM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "arm19.osim")
WIDE = ([-0.9, -1.6, -0.9, 0.1], [0.5, -0.1, 0.7, 1.9])
USUAL = ([-0.5, -1.4, -0.6, 0.1], [0.3, -0.2, 0.4, 1.6])
# name, seed, reaches, s, largest excitation that is asked for, range of the postures (rad)
MOTIONS = [("slow", 1, 5, 8, 0.2, WIDE), ("brisk", 2, 8, 8, 0.35, WIDE), ("strong", 5, 8, 8, 0.45, WIDE),
           ("held_out", 13, 6, 6, 0.3, USUAL)]
# What is wrong, and the noise that the costs are told: EMG as a share of its value, residual torques in N m.
CONDITIONS = {
    "exact": {"lengths": 1, "noise": 0, "shape": 0, "insertions": 0, "markers": 0, "cost": "emg_spread: 0.02, emg_value: 0.02, "
              "residual_torque: 0.02", "noise_time": 0.03},
    "noise": {"lengths": 1, "noise": 0.1, "shape": 1, "insertions": 0, "markers": 0, "cost": "emg_spread: 0.02, emg_value: 0.06, "
              "residual_torque: 0.02", "noise_time": 0.03},
    "insertions": {"lengths": 1, "noise": 0.1, "shape": 1, "insertions": 0.003, "markers": 0, "cost": "emg_spread: 0.02, "
                   "emg_value: 0.06, residual_torque: 0.02", "noise_time": 0.03},
    # The same data, EMG taken as the truth: what residual torques are left is made small.
    "plain": {"lengths": 1, "noise": 0.1, "shape": 1, "insertions": 0, "markers": 0, "cost": "emg_spread: 0, emg_value: 0.002, "
              "emg_floor: 0.001, residual_torque: 1", "noise_time": 0.03},
    "markers": {"lengths": 0, "noise": 0, "shape": 0, "insertions": 0, "markers": 0.01, "cost": "emg_spread: 0.1, emg_value: 0.1, "
                "residual_torque: 0.1", "noise_time": 0.3},
}
ESTIMATE = """model: {plugin: mhe.model.simbody, file: wrong.osim}
muscle: {plugin: mhe.muscle.hill, curves: degroote2016}
formulation: excitation
horizon: {window: 7, ratio: 3}
bounds: {residual_torques: true}
integrator: {plugin: mhe.integrator.rk, tolerance: 0, stages: 2, max_step: 0.03, activation_step: 3.4}
costs: [{plugin: mhe.cost.emg-markers, markers: 0.001, markers_misfit: 0, %s}]
data: {marker_outlier: 0}
solver: {plugin: mhe.solver.rti, preset: robust, tolerance: 1e-4, max_iterations: 50}
calibrate:
  noise_time: %g
  recordings:
%s  parameters:
%s"""


def write(path, text):
    with open(path, "w") as file:
        file.write(text)


def track(signal, weight, value=None, more=""):
    return "      - {plugin: mhe.cost.track, signal: %s, %s%sweight: %s}\n" % (
        signal, "" if value is None else "value: %s, " % value, more, weight)


def motion_steps(name, seed, n, seconds, level, postures, drop=25):
    """Reaches at random with random co-contraction, then all of them as one motion with smooth excitations."""
    r, now, text, names = random.Random(seed), [-0.1, -0.3, -0.1, 0.1], "", []
    for i in range(n):
        then = [round(a + (b - a) * r.random(), 2) for a, b in zip(*postures)]
        asked = [round(level * r.random() ** 1.5, 3) if r.random() < 0.7 else 0.0 for _ in range(19)]
        names.append("%s_%d" % (name, i))
        text += ("  - name: %s\n    duration: %g\n    intervals: %d\n    toward: %s\n    bounds:\n      - {signal: q, value: %s, to: 0}\n"
                 "      - {signal: qdot, value: [0], to: 0}\n    costs:\n" % (names[-1], seconds / n, seconds * 100 / n, then, now))
        text += (track("qdot", 10, [0]) + track("excitation", 100, asked) + track("activation", 10, asked) +
                 track("q", "1e4", then, "nodes: last, ") + track("qdot", "1e4", [0], "nodes: last, "))
        now = then
    all_of_them = " ".join(names)
    text += ("  - name: %s\n    output: %s\n    drop: %d\n    duration: %g\n    intervals: %d\n    start: [%s]\n    targets: {q: %s, "
             "excitation: %s}\n    costs:\n" % (name, name, drop, seconds + drop / 100, seconds * 100 + drop, ", ".join(names),
                                                 all_of_them, all_of_them))
    return text + (track("q", "1e5") + track("excitation", "1e4") +
                   "      - {plugin: mhe.cost.rate, signal: excitation, weight: 100}\n" + track("activation", 10, [0]) +
                   track("qdot", 100, [0]))


def make_motions(bin_dir, out):
    config = ("model: {plugin: mhe.model.simbody, file: %s}\nmuscle: {plugin: mhe.muscle.hill, curves: degroote2016}\n"
              "formulation: excitation\nintegrator: {plugin: mhe.integrator.rk, stages: 4, max_step: 0.015, activation_step: 1.7, "
              "tolerance: 5e-6}\nsolver: {plugin: mhe.solver.rti, preset: robust, tolerance: 1e-5, max_iterations: 300}\nsteps:\n" % ARM)
    write(os.path.join(out, "motions.yaml"), config + "".join(motion_steps(*motion) for motion in MOTIONS))
    subprocess.run([os.path.join(bin_dir, "mhe-sim"), "reference", "motions.yaml", "--out", "motions"], cwd=out, check=True)


def spoil(draw, condition, out, folder):
    """The model with wrong numbers, the EMG with gains, shape and noise; -> the config."""
    r, how = random.Random(1000 + draw), CONDITIONS[condition]
    with open(ARM) as file:
        text = file.read()
    names = re.findall(r'<\w+Muscle name="([^"]+)"', text)

    def cut(sd):  # normal, cut at two standard deviations
        return max(-2, min(2, r.gauss(0, 1))) * sd

    factors = [{name: math.exp(cut(0.3)) for name in names}, {name: 1 + cut(0.1) for name in names},
               {name: 1 + cut(0.05) for name in names}]
    gain, shape = {name: math.exp(cut(0.2)) for name in names}, {name: -r.uniform(0, 2) for name in names}

    def muscle(found):
        name, element = found.group(1), found.group(0)
        for tag, factor in zip(("max_isometric_force", "optimal_fiber_length", "tendon_slack_length"), factors):
            element = re.sub("(<%s>)([^<]+)" % tag, lambda m: m.group(1) + "%.10g" % (float(m.group(2)) * factor[name]), element)
        if how["insertions"]:
            last = list(re.finditer("<location>([^<]+)</location>", element))[-1]
            moved = [float(x) + r.gauss(0, how["insertions"] / math.sqrt(3)) for x in last.group(1).split()]
            element = element[:last.start(1)] + "%.7g %.7g %.7g" % tuple(moved) + element[last.end(1):]
        return element

    def marker(found):
        moved = [float(x) + r.gauss(0, how["markers"]) for x in found.group(2).split()]
        return found.group(1) + "%.7g %.7g %.7g" % tuple(moved) + found.group(3)

    if how["lengths"]:
        text = re.sub(r'<\w+Muscle name="([^"]+)">.*?</\w+Muscle>', muscle, text, flags=re.S)
    if how["markers"]:
        text = re.sub(r'(<Marker name="[^"]+">.*?<location>)([^<]+)(</location>)', marker, text, flags=re.S)
    write(os.path.join(folder, "wrong.osim"), text)
    for motion in MOTIONS:
        with open(os.path.join(out, "motions", motion[0], "emg.sto")) as file:
            rows = file.read().split("\n")
        head = next(i for i, row in enumerate(rows) if row.startswith("time"))
        data = [[float(x) for x in row.split("\t")] for row in rows[head + 1:] if row.strip()]
        for j, name in enumerate(rows[head].split("\t")[1:]):
            for row in data:
                value, a = row[j + 1], shape[name]
                if how["shape"]:
                    value = math.log1p(value * math.expm1(a)) / a
                if how["lengths"]:
                    value /= gain[name]
                row[j + 1] = max(0, value * (1 + how["noise"] * r.gauss(0, 1)))
        write(os.path.join(folder, motion[0] + "_emg.sto"), "\n".join(
            rows[:head + 1] + ["\t".join("%.8g" % x for x in row) for row in data]) + "\n")
    estimated = ["max_isometric_force, sd: 0.3", "optimal_fiber_length, sd: 0.1", "tendon_slack_length, sd: 0.05", "emg_gain, sd: 0.2"]
    estimated += ["insertion, sd: 0.003"] * (how["insertions"] > 0)
    estimated += ["emg_shape, mean: -1, sd: 0.6"] * how["shape"] + ["marker_offset, sd: 0.01"] * (how["markers"] > 0)
    recordings = "".join("    - {markers: %s/markers.trc, emg: %s_emg.sto, reference: %s/reference.sto, hold_out: %s}\n" % (
        os.path.join(out, "motions", m[0]), m[0], os.path.join(out, "motions", m[0]), str(m[0] == "held_out").lower()) for m in MOTIONS)
    return ESTIMATE % (how["cost"], how["noise_time"], recordings, "".join("    - {name: %s}\n" % p for p in estimated))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin_dir")
    parser.add_argument("out")
    parser.add_argument("--draws", default="1-10")
    parser.add_argument("--conditions", default=",".join(CONDITIONS))
    args = parser.parse_args()
    bin_dir, out = os.path.abspath(args.bin_dir), os.path.abspath(args.out)
    os.makedirs(out, exist_ok=True)
    if not os.path.exists(os.path.join(out, "motions")):
        make_motions(bin_dir, out)
    first, last = (int(x) for x in (args.draws + "-" + args.draws).split("-")[:2])
    for condition in args.conditions.split(","):
        for draw in range(first, last + 1):
            folder = os.path.join(out, "%s-%d" % (condition, draw))
            os.makedirs(folder, exist_ok=True)
            write(os.path.join(folder, "person.yaml"), spoil(draw, condition, out, folder))
            result = os.path.join(folder, "person", "calibration.json")
            if not os.path.exists(result):  # those of a run that was broken off stay
                subprocess.run([os.path.join(bin_dir, "mhe-calibrate"), "person.yaml", "--out", "person", "--quiet"], cwd=folder,
                               check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            with open(result) as file:
                told = json.load(file)
            held = next(recording for recording in told["recordings"] if recording["held_out"])
            print("%s, draw %d: %s after %d iterations, %.1f s; forces %.1f -> %.2f N, angles %.3f -> %.3f deg" % (
                condition, draw, told["outcome"], told["iterations"], told["processor_seconds"], held["before"]["force_n"],
                held["after"]["force_n"], held["before"]["q_deg"], held["after"]["q_deg"]), flush=True)


main()
