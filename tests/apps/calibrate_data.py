#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""mhe-calibrate with external loads, a walk, other curves and weights of markers."""
import csv
import json
import os
import re

from calibrate_rig import ARM, CALIBRATE, CONFIG, SOURCE, STRONGER, all_of, expect, make_motion, make_person, run, write


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


all_of([test_loaded, test_walks, test_curves_of_2021, test_marker_weights])
