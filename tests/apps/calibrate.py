#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mhe-calibrate: a person whose muscles are not the model's, found again from a recording; and what is wrong input.

    calibrate.py PATH/mhe-calibrate PATH/mhe-sim SOURCE_DIR search|data|told

The truth is arm19, whose motions mhe-sim makes; the model that is calibrated has other strengths and fibre lengths, its EMG
other gains. What counts are the forces of a motion that was not learned from.
"""
import csv
import json
import os
import random
import re
import subprocess
import sys
import tempfile

CALIBRATE, SIM, SOURCE = (os.path.abspath(path) for path in sys.argv[1:4])
ARM = os.path.join(SOURCE, "models", "arm19", "arm19.osim")
STRONGER = {"BRA": 1.4, "TricepsLong": 0.7, "Deltoid1": 1.3}
GAIN = {"BRA": 1.25, "Deltoid2": 0.8}


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)


def write(name, text):
    with open(name, "w") as file:
        file.write(text)


def make_motion(name, seed, least, more="", curves="{curves: degroote2016}"):
    """Postures at random, followed with the least excitation above `least`."""
    r = random.Random(seed)
    low, high = [-0.4, -1.4, -0.6, 0.1], [0.3, -0.2, 0.4, 1.6]
    rows, time = [(0, [-0.1, -0.3, -0.1, 0.3])], 0
    while time < 2:
        time += 0.5
        rows.append((time, [r.uniform(a, b) for a, b in zip(low, high)]))
    write(name + "_postures.sto", "postures\nnRows=%d\nnColumns=5\ninDegrees=no\nendheader\ntime\tArm_RotY\tArm_RotX\t"
          "Arm_RotY2\tLowerArm1_RotZ\n%s\n" % (len(rows), "\n".join("\t".join("%.4f" % x for x in [t] + q) for t, q in rows)))
    write(name + ".yaml", "model: {file: %s}\nmuscle: %s\nhorizon: {window: 7, ratio: 1}\n"
          "bounds: {excitation_min: %g}\ncosts: [mhe.cost.min-excitation]\nsolver: mhe.solver.rti\n%s" % (ARM, curves, least, more))
    done = run(SIM, "follow", name + ".yaml", "--input", name + "_postures.sto", "--out", name)
    assert done.returncode == 0, done.stderr


def make_person(names):
    """The model with other strengths, and the EMG with other gains."""
    with open(ARM) as file:
        text = file.read()
    for name, factor in STRONGER.items():
        text = re.sub(r'(Muscle name="%s">.*?<max_isometric_force>)([^<]+)' % name,
                      lambda m: m.group(1) + "%.10g" % (float(m.group(2)) / factor), text, count=1, flags=re.S)
    write("model.osim", text)
    for motion in names:
        with open(motion + "/emg.sto") as file:
            lines = file.read().split("\n")
        head = next(i for i, line in enumerate(lines) if line.startswith("time"))
        labels = [re.sub("^e_", "", label) for label in lines[head].split("\t")]
        rows = [line.split("\t") for line in lines[head + 1:] if line]
        for row in rows:
            for i, label in enumerate(labels):
                row[i] = "%.8g" % (float(row[i]) / GAIN.get(label, 1))
        write(motion + "_emg.sto", "\n".join(lines[:head + 1] + ["\t".join(row) for row in rows]) + "\n")


CONFIG = """model: {file: model.osim}
muscle: {curves: degroote2016}
horizon: {window: 7, ratio: 3}
bounds: {residual_torques: true}
costs: [{plugin: mhe.cost.emg-markers, markers: 0.001, emg_spread: 0.1, residual_torque: 0.1}]
solver: mhe.solver.rti
calibrate:
  recordings:
    - {markers: A/markers.trc, emg: A_emg.sto, reference: A/reference.sto}
    - {markers: B/markers.trc, emg: B_emg.sto, reference: B/reference.sto}
    - {markers: C/markers.trc, emg: C_emg.sto, reference: C/reference.sto, hold_out: true}
  parameters:
    - {name: max_isometric_force, sd: 0.2, muscles: [BRA, TricepsLong, Deltoid1, Pectoral2]}
    - {name: emg_gain, muscles: [BRA, Deltoid2]}
"""


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


def expect(what, config, *words):
    write("bad.yaml", config)
    done = run(CALIBRATE, "bad.yaml", "--out", "bad", "--quiet")
    lines = [line for line in done.stderr.split("\n") if line and "warning" not in line]
    assert done.returncode == 2, (what, done.returncode, done.stderr)
    assert len(lines) == 1, (what, done.stderr)
    for word in words:
        assert word in lines[0], (what, word, lines[0])
    assert not os.path.exists("bad/calibrated.osim"), what


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


WEIGHT = """<OpenSimDocument Version="40000"><ExternalLoads name="hand"><objects><ExternalForce name="weight">
<applied_to_body>%s</applied_to_body><force_expressed_in_body>ground</force_expressed_in_body>
<point_expressed_in_body>hand</point_expressed_in_body><force_identifier>f</force_identifier><point_identifier>p</point_identifier>
</ExternalForce></objects><datafile>weight.sto</datafile></ExternalLoads></OpenSimDocument>
"""


def write_weight(newtons, seconds):
    """A weight in the hand, down along the ground's z."""
    row = "\t0\t0\t%g\t0\t-0.05\t0\n" % -newtons
    write("weight.sto", "weight\nversion=1\nnRows=2\nnColumns=7\ninDegrees=no\nendheader\ntime\tfx\tfy\tfz\tpx\tpy\tpz\n0%s%g%s" %
          (row, seconds, row))
    write("weight.xml", WEIGHT % "hand")


def test_loaded():
    """A recording with a known weight in the hand, beside one without: the weight acts in its own recording alone."""
    write_weight(20, 3)
    make_motion("L", 2, 0.15, "data: {external_loads: weight.xml}\n")
    make_person("L")
    loaded = CONFIG.replace("markers: B/", "markers: L/").replace("emg: B_", "emg: L_").replace(
        "B/reference.sto", "L/reference.sto, external_loads: weight.xml")
    forces = {}
    for name, config in (("loaded", loaded), ("weightless", loaded.replace(", external_loads: weight.xml", ""))):
        write("loaded.yaml", config)
        done = run(CALIBRATE, "loaded.yaml", "--out", name, "--quiet")
        assert done.returncode == 0, done.stderr
        with open(name + "/calibration.json") as file:
            told = json.load(file)
        assert told["outcome"] == "converged", (name, told["outcome"])
        forces[name] = [(r["before"]["force_n"], r["after"]["force_n"]) for r in told["recordings"]]
        with open(name + "/parameters.csv") as file:
            rows = {row["parameter"]: row for row in csv.DictReader(file)}
        for muscle, factor in STRONGER.items():
            row = rows["max_isometric_force of " + muscle]
            off = abs(float(row["after"]) - factor) / float(row["sd"])
            assert muscle != "BRA" or (off < 2 if name == "loaded" else off > 10), (name, off, row)
            assert name != "loaded" or off < 2, (off, row)
    assert all(after < 0.1 * before for before, after in forces["loaded"]), forces
    assert forces["weightless"][1][1] > 5 * forces["loaded"][1][1], forces  # the weight taken for weakness
    # Before all recordings, alone, and from the data section.
    alone = re.sub(r"    - \{markers: [AL].*\n", "", loaded).replace(
        "calibrate:", "data: {markers: L/markers.trc, emg: L_emg.sto, external_loads: weight.xml}\ncalibrate:", 1)
    write("alone.yaml", alone)
    done = run(CALIBRATE, "alone.yaml", "--out", "alone", "--quiet", "--set", "calibrate.max_iterations=1")
    assert done.returncode == 0, done.stderr
    with open("alone/calibrated.yaml") as file:
        assert "weight.xml" in file.read()  # and mhe-run estimates with it
    write_weight(20, 1)  # it ends before the motion does: told before the search, held out or not
    expect("short loads", loaded, "weight.xml", "0 to 1 s", "L/markers.trc", "0 to 2 s")
    expect("short held-out loads", loaded.replace("hold_out: true", "hold_out: true, external_loads: weight.xml").replace(
        "L/reference.sto, external_loads: weight.xml", "L/reference.sto"), "weight.xml", "0 to 1 s", "C/markers.trc")
    write("weight.xml", WEIGHT % "hnad")
    expect("a load on no body", loaded, "weight.xml", "hnad")
    expect("no loads", loaded.replace("weight.xml", "wieght.xml"), "wieght.xml")


WALK = """model: {file: weaker.osim, unsupported: warn, paths: fitted, locked_at: {lumbar_extension: -0.4}}
formulation: activation
data:
  markers: %(walk)s_markers.trc
  emg: %(walk)s_emg.sto
  emg_delay: 0
  external_loads: %(walk)s_loads.xml
  reference: %(walk)s_reference.sto
horizon: {window: 7, ratio: 1}
bounds: {residual_torques: true, residual_torque_max: 1000}
integrator: {plugin: mhe.integrator.rk, scheme: gauss, stages: 1, max_step: 0.02, tolerance: 0}
costs: [{plugin: mhe.cost.emg-markers, emg_spread: 0.1, residual_torque: 3}]
calibrate: {noise_time: 0.05, parameters: [{name: max_isometric_force, muscles: [%(muscles)s]}]}
"""


def test_walks():
    """Strengths of legs from a walk under the ground's reaction; the known motion has residual forces of 3 N."""
    weaker = {"soleus_r": 1.3, "gastroc_r": 0.75, "vasti_r": 1.25, "glut_max_r": 0.8}
    folder = os.path.join(SOURCE, "models", "gait10dof")
    with open(os.path.join(folder, "subject01.osim")) as file:
        text = file.read()
    for name, factor in weaker.items():
        text = re.sub(r'(Muscle name="%s">.*?<max_isometric_force>)([^<]+)' % name,
                      lambda m: m.group(1) + "%.10g" % (float(m.group(2)) / factor), text, count=1, flags=re.S)
    write("weaker.osim", text)
    write("walk.yaml", WALK % {"walk": os.path.join(folder, "demo_walk"), "muscles": ", ".join(weaker)})
    done = run(CALIBRATE, "walk.yaml", "--out", "walk", "--quiet")
    assert done.returncode == 0, done.stderr
    with open("walk/calibration.json") as file:
        told = json.load(file)
    assert told["outcome"] == "converged", told["outcome"]
    forces = told["recordings"][0]
    assert forces["after"]["force_n"] < 0.6 * forces["before"]["force_n"], forces  # with the true strengths: the same
    with open("walk/parameters.csv") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    for name, factor in weaker.items():
        row = rows["max_isometric_force of " + name]
        assert abs(float(row["after"]) - factor) < 2 * float(row["sd"]) < 0.45, (name, row)


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


def drop_columns(path, to, names):
    with open(path) as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("time"))
    labels = lines[head].split("\t")
    keep = [i for i, label in enumerate(labels) if re.sub("^e_", "", label) not in names]
    lines[:head] = [re.sub("nColumns=.*", "nColumns=%d" % len(keep), line) for line in lines[:head]]
    cut = ["\t".join(line.split("\t")[i] for i in keep) for line in lines[head:] if line]
    write(to, "\n".join(lines[:head] + cut) + "\n")


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
    with open("B_emg.sto") as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line.startswith("time"))
    labels = [re.sub("^e_", "", label) for label in lines[head].split("\t")]
    for i in range(head + 1, len(lines)):
        cells = lines[i].split("\t")
        if len(cells) == len(labels):
            cells[labels.index("SubScap")] = "0.2"
            cells[labels.index("BRD")] = "%.6g" % (8 * float(cells[labels.index("BRD")]))
            lines[i] = "\t".join(cells)
    write("B_odd.sto", "\n".join(lines))
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


def test_curves_of_2021():
    """Fibre and slack lengths with the curves of paper2021, whose passive force is switched by both."""
    curves = "{curves: paper2021, passive_ramp: 0.3}"
    make_motion("P", 1, 0.03, curves=curves)
    make_motion("Q", 3, 0.08, curves=curves)
    truth = [("BRA", "max_isometric_force", 1.3), ("BRA", "optimal_fiber_length", 1.1), ("TricepsLong", "optimal_fiber_length", 0.93),
             ("BicepsLong", "tendon_slack_length", 0.97)]
    with open(ARM) as file:
        text = file.read()
    for name, tag, factor in truth:
        text = re.sub(r'(Muscle name="%s">.*?<%s>)([^<]+)' % (name, tag),
                      lambda m: m.group(1) + "%.10g" % (float(m.group(2)) / factor), text, count=1, flags=re.S)
    write("curves.osim", text)
    config = CONFIG[:CONFIG.index("  recordings:")].replace("model.osim", "curves.osim").replace("{curves: degroote2016}", curves)
    write("curves.yaml", config + """  recordings:
    - {markers: P/markers.trc, emg: P/emg.sto, reference: P/reference.sto}
    - {markers: Q/markers.trc, emg: Q/emg.sto, reference: Q/reference.sto, hold_out: true}
  parameters:
    - {name: max_isometric_force, muscles: [BRA]}
    - {name: optimal_fiber_length, muscles: [BRA, TricepsLong]}
    - {name: tendon_slack_length, muscles: [BicepsLong]}
""")
    done = run(CALIBRATE, "curves.yaml", "--out", "curves", "--quiet")
    assert done.returncode == 0, done.stderr
    with open("curves/calibration.json") as file:
        told = json.load(file)
    assert told["outcome"] == "converged", told["outcome"]
    held = told["recordings"][1]
    assert held["after"]["force_n"] < 0.1 * held["before"]["force_n"], held
    found = {p["name"]: p for p in told["parameters"]}
    for name, tag, factor in truth:
        p = found["%s of %s" % (tag, name)]
        assert abs(p["after"] - factor) < 2.5 * p["sd"] and p["verdict"] == "informed", (factor, p)


def test_marker_weights():
    """A marker of weight 0 is as good as one that was never seen."""
    for kind in ("off", "gone"):
        for motion in "ABC":
            with open(motion + "/markers.trc") as file:
                lines = file.read().split("\n")
            head = next(i for i, line in enumerate(lines) if line.startswith("1\t"))
            for i in range(head, len(lines)):
                cells = lines[i].split("\t")
                for j in range(3 * 7 + 2, min(3 * 8 + 2, len(cells))):  # STYLu
                    cells[j] = "%.6f" % (float(cells[j]) + 15) if kind == "off" else ""
                lines[i] = "\t".join(cells)
            write("%s_%s.trc" % (motion, kind), "\n".join(lines))
    found = []
    for kind, weights in (("off", "marker_weights: {STYLu: 0}"), ("gone", "marker_weights: {}"), ("off", "marker_weights: {}")):
        write("weights.yaml", re.sub("([ABC])/markers", r"\1_" + kind, CONFIG).replace("calibrate:", "data: {%s}\ncalibrate:" % weights))
        done = run(CALIBRATE, "weights.yaml", "--out", "weights", "--quiet", "--set", "calibrate.tolerance=1e-12")
        assert done.returncode == 0, done.stderr
        with open("weights/calibration.json") as file:
            found.append([one["after"] for one in json.load(file)["parameters"]])
    off = [max(abs(a - b) for a, b in zip(found[0], other)) for other in found[1:]]
    assert off[0] < 1e-4 and off[1] > 1e-2, off


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
    for cost, why in (("{plugin: mhe.cost.rate, signal: excitation}", "the node before"),
                      ("{plugin: mhe.cost.track, signal: muscle_force, value: [0]}", "muscle forces")):
        expect(cost, re.sub("costs: .*", costs % cost, CONFIG), "bad.yaml:5", "costs.1", why, "Leave it out")
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
    expect("absent", CONFIG.replace("A_emg.sto", "A_gme.sto"), "A_gme.sto")


PARTS = {"search": [test_finds, test_where_and_when, test_delay, test_scales_first, test_solvers_agree],
         "data": [test_loaded, test_walks, test_curves_of_2021, test_marker_weights],
         "told": [test_told, test_channels, test_another_person, test_wrong_input]}


def main():
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        make_motion("A", 1, 0.03)
        make_motion("B", 2, 0.15)
        make_motion("C", 3, 0.08)
        make_person("ABC")
        for test in PARTS[sys.argv[4]]:
            test()


main()
