#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What mhe-calibrate tells of its recordings and parameters, and what is wrong input."""
import csv
import os
import re

from calibrate_rig import CALIBRATE, CONFIG, all_of, expect, run, write


def drop_columns(path, to, names):
    with open(path) as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("time"))
    labels = lines[head].split("\t")
    keep = [i for i, label in enumerate(labels) if re.sub("^e_", "", label) not in names]
    lines[:head] = [re.sub("nColumns=.*", "nColumns=%d" % len(keep), line) for line in lines[:head]]
    cut = ["\t".join(line.split("\t")[i] for i in keep) for line in lines[head:] if line]
    write(to, "\n".join(lines[:head] + cut) + "\n")


def change_emg(to, changes):
    """B_emg.sto with a column's cells by what `changes` makes of them: {muscle: cell -> cell}."""
    with open("B_emg.sto") as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("time"))
    labels = [re.sub("^e_", "", label) for label in lines[head].split("\t")]
    for i in range(head + 1, len(lines)):
        cells = lines[i].split("\t")
        if len(cells) == len(labels):
            for name, change in changes.items():
                cells[labels.index(name)] = change(cells[labels.index(name)])
            lines[i] = "\t".join(cells)
    write(to, "\n".join(lines))


def test_told():
    """What the recordings say nothing about, and what they say against what was expected, is told by name."""
    for motion in "AB":
        drop_columns(motion + "_emg.sto", motion + "_less.sto", ["Latissimus1"])
    config = CONFIG.replace("A_emg", "A_less").replace("B_emg", "B_less").split("    - {markers: C")[0] + """  parameters:
    - {name: emg_gain, sd: 0.25, muscles: [Latissimus1]}
    - {name: max_isometric_force, sd: 0.02, muscles: [TricepsLong]}
    - {name: max_isometric_force, upper: 1.01, muscles: [BRA]}
"""
    write("told.yaml", config)
    done = run(CALIBRATE, "told.yaml", "--out", "told")
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stderr.split("\n") if " of " in line and "warning" not in line]
    assert any(line.startswith("emg_gain of Latissimus1: not informed") for line in lines), lines
    assert any("max_isometric_force of TricepsLong: the data contradict" in line for line in lines), lines
    assert not any("TricepsLong: not informed" in line for line in lines), lines
    assert any("max_isometric_force of BRA stands at its bound, 1.01" in line for line in lines), lines
    with open("told/parameters.csv") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    row = rows["emg_gain of Latissimus1"]
    assert row["verdict"] == "not informed" and abs(float(row["after"]) - 1) < 1e-3, row
    assert abs(float(row["sd"]) - 0.25) < 1e-3, row
    assert rows["max_isometric_force of BRA"]["verdict"] == "at bound", rows


def test_channels():
    """An electrode that was off and an MVC that was no maximum are told by the muscle's name; the calibration goes on."""
    change_emg("B_odd.sto", {"SubScap": lambda _: "0.2", "BRD": lambda value: "%.6g" % (8 * float(value))})
    write("odd.yaml", CONFIG.replace("B_emg", "B_odd"))
    done = run(CALIBRATE, "odd.yaml", "--out", "odd", "--set", "calibrate.max_iterations=1")
    assert done.returncode == 0, done.stderr
    lines = done.stderr.split("\n")
    assert any("B_odd.sto: the same value" in line and "SubScap" in line for line in lines), lines
    told = [line for line in lines if "times its MVC" in line]
    assert len(told) == 1 and told[0].startswith("EMG of BRD reaches 1.20 times its MVC"), told
    assert "emg_gain for it" in told[0], told
    done = run(CALIBRATE, "odd.yaml", "--out", "odd", "--set", "calibrate.max_iterations=1", "--set", "calibrate.recordings=["
               "{markers: B/markers.trc, emg: B_odd.sto}]", "--set", "calibrate.parameters=[{name: emg_gain, muscles: [BRD]}]")
    assert done.returncode == 0, done.stderr
    assert "EMG of SubScap is 0.2 in every sample" in done.stderr, done.stderr
    assert re.search(r"EMG of BRD reaches 1.20 times its MVC.*its emg_gain became", done.stderr), done.stderr


def test_doubts():
    """What is never there, hardly there, or wider than it may be, is told before anything is learned."""
    change_emg("B_faint.sto", {"SubScap": lambda _: "nan", "BRD": lambda value: "%.6g" % (1e-3 * float(value))})
    with open("B/markers.trc") as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("1\t"))
    second = [label for label in lines[3].split("\t")[2:] if label][1]
    for i in range(head, len(lines)):
        cells = lines[i].split("\t")
        lines[i] = "\t".join(cells[:5] + [""] * 3 + cells[8:]) if len(cells) > 8 else lines[i]
    write("B_less.trc", "\n".join(lines))
    config = CONFIG.replace("B_emg", "B_faint").replace("B/markers.trc", "B_less.trc").replace("sd: 0.2", "sd: 5")
    write("doubts.yaml", config.replace("calibrate:", "calibrate:\n  noise_time: 10"))
    done = run(CALIBRATE, "doubts.yaml", "--out", "doubts", "--quiet", "--set", "calibrate.max_iterations=1")
    assert done.returncode == 0, done.stderr
    for said in ("B_faint.sto: muscles without EMG in any frame: SubScap;", "B_faint.sto: EMG of a two-hundredth of what another "
                 "recording has: BRD;", "B_less.trc: markers that are missing in every frame: %s;" % second,
                 "max_isometric_force: 'sd' is 5, wider than its bounds, 0.2 .. 3", "noise_time: 10 s is longer than each recording (2 s"):
        assert said in done.stderr, (said, done.stderr)


def test_copies():
    """A recording that is there twice counts twice, and one that is held out should not have been learned from."""
    write("copy.trc", open("B/markers.trc").read())
    for line, said in (("{markers: copy.trc, emg: B_emg.sto, reference: B/reference.sto}", "and 4 (%s/copy.trc) are the same: it counts twice"),
                       ("{markers: copy.trc, emg: B_emg.sto, hold_out: true}", "and 4 (%s/copy.trc) are the same: what is held out")):
        write("copies.yaml", CONFIG.replace("  parameters:", "    - %s\n  parameters:" % line))
        done = run(CALIBRATE, "copies.yaml", "--out", "copies", "--set", "calibrate.max_iterations=1")
        assert done.returncode == 0, done.stderr
        told = [line for line in done.stderr.split("\n") if "are the same: " in line]
        assert len(told) == 1 and said % os.getcwd() in told[0] and "recordings 2 (" in told[0], done.stderr


def test_another_person():
    """5 % larger all over: too little to be refused by the markers' distances, but no model fits both."""
    with open("B/markers.trc") as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("1\t"))
    for i in range(head, len(lines)):
        cells = lines[i].split("\t")
        lines[i] = "\t".join(cells[:2] + ["%.6f" % (1.05 * float(cell)) if cell else "" for cell in cells[2:]])
    write("larger.trc", "\n".join(lines))
    write("larger.yaml", CONFIG.replace("B/markers.trc", "larger.trc"))
    done = run(CALIBRATE, "larger.yaml", "--out", "larger", "--set", "calibrate.max_iterations=2")
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stderr.split("\n") if "another person" in line]
    assert len(told) == 1 and told[0].startswith("larger.trc: markers stay 2"), done.stderr


def test_wrong_input():
    expect("no section", CONFIG.split("calibrate:")[0], "bad.yaml", "calibrate")
    expect("unknown parameter", CONFIG.replace("emg_gain", "emg_gian"), "bad.yaml:14", "emg_gain")
    expect("unknown muscle", CONFIG.replace("[BRA, Deltoid2]", "[BRA, Deltoid8]"), "bad.yaml:14", "Deltoid8", "Deltoid")
    expect("bounds cross", CONFIG.replace("sd: 0.2,", "sd: 0.2, lower: 2, upper: 1,"), "bad.yaml:13", "lower", "2", "1")
    expect("percent", CONFIG.replace("sd: 0.2,", "sd: 0.2, lower: 80, upper: 120,"), "bad.yaml:13", "'lower' is 80", "factor")
    expect("newtons", CONFIG.replace("sd: 0.2,", "sd: 0.2, mean: 900,"), "bad.yaml:13", "'mean' is 900", "factor")
    expect("millimetres", CONFIG.replace("{name: emg_gain, muscles: [BRA, Deltoid2]}", "{name: marker_offset, lower: -20, upper: 20}"),
           "bad.yaml:14", "'lower' is -20", "in m: 10 mm are 0.01")
    expect("milliseconds", CONFIG.replace("{name: emg_gain, muscles: [BRA, Deltoid2]}", "{name: emg_delay, upper: 50}"), "bad.yaml:14",
           "'upper' is 50", "in s: 50 ms are 0.05")
    expect("mean outside", CONFIG.replace("sd: 0.2,", "sd: 0.2, mean: 9,"), "bad.yaml:13", "mean", "9")
    expect("a muscle's bodies", CONFIG.replace("emg_gain", "insertion, bodies: [hand]"), "bad.yaml:14", "insertion", "bodies")
    expect("unknown body", CONFIG.replace("{name: emg_gain, muscles: [BRA, Deltoid2]}", "{name: segment_mass, bodies: [hnad]}"),
           "bad.yaml:14", "hnad", "hand")
    expect("too heavy", CONFIG.replace("{name: emg_gain, muscles: [BRA, Deltoid2]}", "segment_mass").replace(
        "calibrate:", "calibrate:\n  body_mass: 500"), "bad.yaml", "body_mass", "500 kg", "3")
    expect("fitted paths", CONFIG.replace("emg_gain", "insertion").replace("osim}", "osim, paths: fitted}"), "bad.yaml", "paths",
           "exact")
    expect("twice", CONFIG.replace("[BRA, Deltoid2]", "[BRA, BRA]"), "bad.yaml:14", "BRA", "twice")
    expect("a marker's muscles", CONFIG.replace("emg_gain", "marker_offset"), "bad.yaml:14", "muscles")
    costs = "costs: [{plugin: mhe.cost.emg-markers}, %s]"
    cost = "{plugin: mhe.cost.joint-stability, joint: elbow, axis: [1, 0, 0]}"
    expect(cost, re.sub("costs: .*", costs % cost, CONFIG), "bad.yaml:5", "costs.1", "joint reactions", "Leave it out")
    expect("no motion", CONFIG.replace("markers: B/markers.trc, ", ""), "bad.yaml:10", "markers", "angles")
    expect("no EMG", re.sub(", emg: ._emg.sto", "", CONFIG), "bad.yaml:14", "emg_gain", "no recording")
    expect("nothing to learn from", CONFIG.replace("reference.sto}", "reference.sto, hold_out: true}"), "bad.yaml", "learn")
    with open("B/markers.trc") as file:  # another person's forearm: the last two markers 20 % farther from the one before
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("1\t"))
    for i in range(head, len(lines)):
        cells = lines[i].split("\t")
        for j in range(3 * 6 + 2, min(3 * 8 + 2, len(cells))):
            middle = 3 * 5 + 2 + (j - 2) % 3
            cells[j] = "%.6f" % (float(cells[middle]) + 1.2 * (float(cells[j]) - float(cells[middle])))
        lines[i] = "\t".join(cells)
    write("other.trc", "\n".join(lines))
    expect("two persons", CONFIG.replace("B/markers.trc", "other.trc"), "other.trc", "apart", "one person")
    for name, source, factor, first in (("inches", "B/markers.trc", 39.37, 2), ("faint", "B_emg.sto", 1e-3, 1)):
        with open(source) as file:
            lines = file.read().split("\n")
        head = next(i for i, line in enumerate(lines) if line.startswith("1\t" if first == 2 else "time"))
        for i in range(head + (first == 1), len(lines)):
            cells = lines[i].split("\t")
            lines[i] = "\t".join(cells[:first] + ["%.6g" % (factor * float(cell)) if cell else "" for cell in cells[first:]])
        write(name, "\n".join(lines))
    os.rename("inches", "inches.trc")
    os.rename("faint", "faint.sto")
    expect("inches", CONFIG.replace("B/markers.trc", "inches.trc"), "inches.trc", "39.37 times as far apart", "another unit")
    expect("volts", CONFIG.replace("B_emg.sto", "faint.sto"), "faint.sto", "no muscle reaches 1 % of its MVC", "unit")
    expect("absent", CONFIG.replace("A_emg.sto", "A_gme.sto"), "A_gme.sto")


all_of([test_told, test_channels, test_doubts, test_copies, test_another_person, test_wrong_input])
