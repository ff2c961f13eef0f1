#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What calibration is worth where the model is wrong: one trial of study-mismatch.yaml (docs/study.md).

Makes four motions of arm19 with co-contraction (mhe-sim reference; 40 s), three to learn from and one held out. Each draw then
spoils the model and the EMG, mhe-calibrate starts from the spoilt ones, and what is told are the errors of the held-out motion
before and after. Seeds are the draws' numbers; what is in the study's folder already is not made again.
"""
import argparse
import contextlib
import fcntl
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
# What is wrong; the noise that the costs are told stands in the study.
ERRORS = {
    "exact": {"lengths": 1, "noise": 0, "shape": 0, "insertions": 0, "markers": 0},
    "noise": {"lengths": 1, "noise": 0.1, "shape": 1, "insertions": 0, "markers": 0},
    "insertions": {"lengths": 1, "noise": 0.1, "shape": 1, "insertions": 0.003, "markers": 0},
    "markers": {"lengths": 0, "noise": 0, "shape": 0, "insertions": 0, "markers": 0.01},
}


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
    subprocess.run([os.path.join(bin_dir, "mhe-sim"), "reference", "motions.yaml", "--out", "motions"], cwd=out, check=True,
                   stdout=subprocess.DEVNULL)


def spoil(draw, errors, out, folder):
    """The model with wrong numbers, the EMG with gains, shape and noise; -> the recordings."""
    r, how = random.Random(1000 + draw), ERRORS[errors]
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
    motions = os.path.join(out, "motions")
    return "[%s]" % ", ".join("{markers: %s/markers.trc, emg: %s/%s_emg.sto, reference: %s/reference.sto, hold_out: %s}" % (
        os.path.join(motions, m[0]), folder, m[0], os.path.join(motions, m[0]), str(m[0] == "held_out").lower()) for m in MOTIONS)


@contextlib.contextmanager
def alone(path):
    """Other trials of the study wait."""
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def calibrate(args, errors, plain):
    """mhe-calibrate on a draw, once; what it told."""
    name = "%s-%d" % ("plain" if plain else errors, args.trial + 1)
    folder = os.path.join(args.out, "draws", name)
    os.makedirs(folder, exist_ok=True)
    with alone(os.path.join(args.out, "draws", "motions.lock")):
        if not os.path.exists(os.path.join(args.out, "motions")):
            make_motions(args.bin, args.out)
    result = os.path.join(folder, "person", "calibration.json")
    with alone(os.path.join(args.out, "draws", name + ".lock")):
        if not os.path.exists(result):  # before and after are of one calibration
            recordings = spoil(args.trial + 1, errors, args.out, folder)
            settings = ["model.file=" + os.path.join(folder, "wrong.osim"), "calibrate.recordings=" + recordings] + args.set
            command = [os.path.join(args.bin, "mhe-calibrate"), args.config, "--out", os.path.join(folder, "person"), "--quiet"]
            for setting in settings:
                command += ["--set", setting]
            subprocess.run(command, check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    with open(result) as file:
        return json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("--condition", "--out", "--bin"):
        parser.add_argument(name, required=True)
    parser.add_argument("--trial", type=int, required=True)
    parser.add_argument("--seed", type=int, help="not used: a draw is its number's, so that before and after have the same")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("config")
    args = parser.parse_args()
    args.out, args.bin = os.path.abspath(args.out), os.path.abspath(args.bin)
    labels = dict(part.split("=") for part in args.condition.split(" "))
    told = calibrate(args, labels["errors"], labels["result"] == "plain")
    held = next(recording for recording in told["recordings"] if recording["held_out"])
    of = held["before" if labels["result"] == "before" else "after"]
    print("converged %d\niterations_mean %d" % (told["outcome"] == "converged", told["iterations"]))
    for name in ("q_deg", "force_n", "activation", "marker_mm"):
        if of.get(name) is not None:
            print("%s %.10g" % (name, of[name]))


main()
