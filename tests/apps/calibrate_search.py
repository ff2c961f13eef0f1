#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mhe-calibrate finds what is not the model's: strengths, gains, places, delays, masses; by both solvers, and after scaling."""
import csv
import json
import os
import re

from calibrate_rig import ARM, CALIBRATE, CONFIG, GAIN, STRONGER, all_of, expect, run, write


def test_finds():
    write("person.yaml", CONFIG)
    done = run(CALIBRATE, "person.yaml", "--out", "out", "--quiet")
    assert done.returncode == 0, done.stderr
    with open("out/calibration.json") as file:
        told = json.load(file)
    assert told["outcome"] == "converged", told["outcome"]
    held_out = [r for r in told["recordings"] if r["held_out"]]
    assert [r["name"] for r in told["recordings"]] == ["A/markers.trc", "B/markers.trc", "C/markers.trc"]
    assert len(held_out) == 1
    before, after = held_out[0]["before"]["force_n"], held_out[0]["after"]["force_n"]
    assert after < 0.2 * before, "forces %g N before, %g N after" % (before, after)
    with open("out/parameters.csv") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert len(rows) == 6, rows
    for name, factor in list(STRONGER.items()):
        row = rows["max_isometric_force of " + name]
        off, sd = abs(float(row["after"]) - factor), float(row["sd"])
        assert off < 0.5 * abs(factor - 1) and off < 3 * sd, (name, row)
        assert 0 < sd < 0.15, row  # 0.2 before
    for name, factor in GAIN.items():
        row = rows["emg_gain of " + name]
        assert abs(float(row["after"]) - factor) < 0.1 * factor, (name, row)
    # What it wrote is a model with these numbers, and a config that mhe-run reads.
    with open("out/calibrated.osim") as file:
        text = file.read()
    written = float(re.search(r'Muscle name="BRA">.*?<max_isometric_force>([^<]+)', text, re.S).group(1))
    with open("model.osim") as file:
        was = float(re.search(r'Muscle name="BRA">.*?<max_isometric_force>([^<]+)', file.read(), re.S).group(1))
    assert abs(written / was / float(rows["max_isometric_force of BRA"]["after"]) - 1) < 1e-5
    page = open("out/report.html").read()
    assert "emg_gain of Deltoid2" in page and "held out" in page
    with open("out/calibrated.yaml") as file:
        assert "preset: balanced" in file.read()  # the solver of the config, not what the whole recordings are solved with
    done = run(os.path.join(os.path.dirname(CALIBRATE), "mhe-run"), "--check", "out/calibrated.yaml")
    assert done.returncode == 0, done.stderr


def point_of(text, muscle):
    """The last point of a muscle's path, as numbers and as its place in the text."""
    element = re.search(r'Muscle name="%s">.*?</\w+Muscle>' % muscle, text, re.S)
    last = list(re.finditer("<location>([^<]+)</location>", element.group(0)))[-1]
    return [float(x) for x in last.group(1).split()], element.start() + last.start(1), element.start() + last.end(1)


def test_where_and_when():
    """Where a muscle ends, by how much the EMG is early and what a body weighs are found, and stand in what is written."""
    off, early, heavier = [0.006, -0.004, 0.008], 0.03, 0.7
    with open(ARM) as file:
        truth = file.read()
    at, first, end = point_of(truth, "BRA")
    text = truth[:first] + " ".join("%.10g" % (a - b) for a, b in zip(at, off)) + truth[end:]
    mass = re.search(r'<Body name="LowerArm1">.*?<mass>([^<]+)', text, re.S)
    text = text[:mass.start(1)] + "%.10g" % (float(mass.group(1)) / heavier) + text[mass.end(1):]
    write("moved.osim", text)
    for motion in "ABC":
        with open(motion + "/emg.sto") as file:
            lines = file.read().split("\n")
        head = next(i for i, line in enumerate(lines) if line.startswith("time"))
        rows = [line.split("\t") for line in lines[head + 1:] if line]
        write(motion + "_early.sto", "\n".join(lines[:head + 1] + ["\t".join(["%.4f" % (float(row[0]) - early)] + row[1:])
                                                                  for row in rows]) + "\n")
    config = re.sub("([ABC])_emg", r"\1_early", CONFIG).replace("model.osim", "moved.osim")
    write("moved.yaml", config[:config.index("  parameters:")] + """  parameters:
    - {name: insertion, sd: 0.01, muscles: [BRA]}
    - {name: emg_delay, together: true}
    - {name: segment_mass, sd: 0.3, bodies: [LowerArm1]}
""")
    done = run(CALIBRATE, "moved.yaml", "--out", "moved", "--quiet")
    assert done.returncode == 0, done.stderr
    with open("moved/calibration.json") as file:
        told = json.load(file)
    assert told["outcome"] == "converged", told["outcome"]
    held = next(r for r in told["recordings"] if r["held_out"])
    assert held["after"]["force_n"] < 0.3 * held["before"]["force_n"], held
    with open("moved/parameters.csv") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    found = [rows["insertion of BRA, " + axis] for axis in "xyz"]
    errors = [float(row["after"]) - b for row, b in zip(found, off)]
    assert all(abs(e) < 3 * float(row["sd"]) for e, row in zip(errors, found)), (errors, found)
    assert max(abs(e) for e in errors[:2]) < 0.001, (errors, found)  # z is along the elbow's axis: nothing tells it
    assert float(found[2]["sd"]) > 0.006 > 3 * float(found[1]["sd"]), found
    assert abs(float(rows["emg_delay of Pectoral2 and 18 more"]["after"]) - early) < 0.004, rows
    assert abs(float(rows["segment_mass of LowerArm1"]["after"]) / heavier - 1) < 0.1, rows
    with open("moved/calibrated.osim") as file:
        text = file.read()
    for now, right, shift, row in zip(point_of(text, "BRA")[0], at, off, found):
        assert abs(now - (right - shift) - float(row["after"])) < 1e-7, (now, right, row)
    weighs = re.search(r'<Body name="LowerArm1">.*?<mass>([^<]+)', text, re.S).group(1)
    factor = float(weighs) / float(mass.group(1)) * heavier
    assert abs(factor / float(rows["segment_mass of LowerArm1"]["after"]) - 1) < 1e-5, (weighs, rows)
    with open("moved/calibrated.yaml") as file:
        delays = [float(x) for x in re.findall(r"\bdelay: ([0-9.]+)", file.read())]
    assert any(abs(delay - early) < 0.004 for delay in delays), delays


def test_forces_as_cost():
    """Little forces are asked for beside: strengths are found as without, and the forces are a little less."""
    least = CONFIG.replace("residual_torque: 0.1}]", "residual_torque: 0.1}, {plugin: mhe.cost.track, signal: muscle_force, value: [0], "
                           "sigma: 500}, {plugin: mhe.cost.track, signal: joint_moment, value: [0], sigma: 1000}]")
    write("least.yaml", least)
    done = run(CALIBRATE, "least.yaml", "--out", "least", "--quiet")
    assert done.returncode == 0, done.stderr
    told = []
    for out in ("out", "least"):
        with open(out + "/calibration.json") as file:
            told.append(json.load(file))
    assert told[1]["outcome"] == "converged", told[1]["outcome"]
    values = [[p["after"] for p in t["parameters"]] for t in told]
    off = [abs(a - b) for a, b in zip(*values)]
    assert 1e-4 < max(off) < 0.05, off


def test_delay():
    """Motions of 2 s without noise: a delay is off by less than half its standard deviation, whatever it is."""
    config = re.sub("([ABC])_emg", r"\1_late", CONFIG).replace("model.osim", ARM)
    for early in (0, 0.01):
        for motion in "ABC":
            with open(motion + "/emg.sto") as file:
                lines = file.read().split("\n")
            head = next(i for i, line in enumerate(lines) if line.startswith("time"))
            rows = [line.split("\t", 1) for line in lines[head + 1:] if line]
            write(motion + "_late.sto", "\n".join(lines[:head + 1] + ["%.4f\t%s" % (float(row[0]) - early, row[1])
                                                                     for row in rows]) + "\n")
        write("delay.yaml", config[:config.index("  parameters:")] +
              "  parameters:\n    - {name: emg_delay, together: true, lower: -0.1, mean: 0, sd: 0.1}\n")
        done = run(CALIBRATE, "delay.yaml", "--out", "delay", "--quiet")
        assert done.returncode == 0, done.stderr
        with open("delay/parameters.csv") as file:
            row = next(csv.DictReader(file))
        assert abs(float(row["after"]) - early) < 0.5 * float(row["sd"]) < 0.0025, (early, row)


SETUP = """<OpenSimDocument Version="20302"><ScaleTool name="person"><mass>%s</mass>
<GenericModelMaker><model_file>%s</model_file></GenericModelMaker>
<ModelScaler><apply>true</apply><preserve_mass_distribution>true</preserve_mass_distribution>%s</ModelScaler>
<MarkerPlacer><apply>false</apply></MarkerPlacer></ScaleTool></OpenSimDocument>
"""
BY_HAND = """<scaling_order>manualScale</scaling_order><ScaleSet><objects><Scale><scales>0.9 0.9 0.9</scales><segment>Arm</segment>
<apply>true</apply></Scale></objects></ScaleSet>"""
BY_MARKERS = """<scaling_order>measurements</scaling_order><MeasurementSet><objects><Measurement name="arm"><apply>true</apply>
<MarkerPairSet><objects><MarkerPair><markers> DELT EPICl </markers></MarkerPair></objects></MarkerPairSet>
<BodyScaleSet><objects><BodyScale name="Arm"><axes> X Y Z </axes></BodyScale></objects></BodyScaleSet></Measurement></objects>
</MeasurementSet><marker_file>A/markers.trc</marker_file><time_range> 0 0.1 </time_range>"""


def test_scales_first():
    """From a generic model whose upper arm is too short: scaled to the markers, then calibrated."""
    with open("model.osim") as file:
        mass = sum(float(x) for x in re.findall("<mass>([^<]+)</mass>", file.read()))
    write("short.xml", SETUP % (mass, "model.osim", BY_HAND))
    write("person.xml", SETUP % (mass, "short.osim", BY_MARKERS))
    done = run(os.path.join(os.path.dirname(CALIBRATE), "mhe-model"), "scale", "short.xml", "--out", "short.osim")
    assert done.returncode == 0, done.stderr
    write("scaled.yaml", CONFIG.replace("model.osim", "short.osim").replace("calibrate:", "calibrate:\n  scale: person.xml"))
    done = run(CALIBRATE, "scaled.yaml", "--out", "scaled")
    assert done.returncode == 0, done.stderr
    assert re.search(r"Arm +1\.1111", done.stderr), done.stderr
    with open("scaled/calibration.json") as file:
        told = json.load(file)
    held = next(r for r in told["recordings"] if r["held_out"])
    assert held["before"]["q_deg"] > 1 > 20 * held["after"]["q_deg"], held
    with open("scaled/calibrated.osim") as one, open("model.osim") as other:
        found, right = point_of(one.read(), "SupraSpin")[0], point_of(other.read(), "SupraSpin")[0]
    assert max(abs(a - b) for a, b in zip(found, right)) < 1e-5, (found, right)
    expect("no setup", CONFIG.replace("calibrate:", "calibrate:\n  scale: absent.xml"), "absent.xml")


def test_solvers_agree():
    """The bordered recursion against Ipopt on a short recording whose controls stay off their bounds (where Ipopt's are relaxed)."""
    found = []  # both until the objective does not change: a part of 1e-12 of it is 1e-7 of a gain
    recording = "    - {markers: B/markers.trc, emg: B_emg.sto, reference: B/reference.sto}\n"
    config = re.sub(r"    - \{markers: [AC].*\n", "", CONFIG)
    assert recording in config
    write("agree.yaml", config)
    for solver in ("rti", "ipopt"):
        done = run(CALIBRATE, "agree.yaml", "--out", solver, "--quiet", "--set", "calibrate.solver=" + solver, "--set",
                   "calibrate.tolerance=1e-15", "--set", "calibrate.max_iterations=100")
        assert done.returncode == 0, done.stderr
        with open(solver + "/calibration.json") as file:
            told = json.load(file)
        assert told["outcome"] == "converged", (solver, told["outcome"])
        found.append(told["parameters"])
    moved = [abs(one["after"] - one["before"]) for one in found[0]]
    off = max(abs(one["after"] - other["after"]) for one, other in zip(*found))
    assert max(moved) > 0.1 and off < 1e-8, (moved, off)


all_of([test_finds, test_forces_as_cost, test_where_and_when, test_delay, test_scales_first, test_solvers_agree])
