# SPDX-License-Identifier: Apache-2.0
"""What the tests of mhe-calibrate share: a person whose muscles are not the model's, and recordings of it.

    calibrate_PART.py PATH/mhe-calibrate PATH/mhe-sim SOURCE_DIR

The truth is arm19, whose motions mhe-sim makes; the model that is calibrated has other strengths and fibre lengths, its EMG
other gains. What counts are the forces of a motion that was not learned from.
"""
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


def expect(what, config, *words):
    write("bad.yaml", config)
    done = run(CALIBRATE, "bad.yaml", "--out", "bad", "--quiet")
    lines = [line for line in done.stderr.split("\n") if line and "warning" not in line]
    assert done.returncode == 2, (what, done.returncode, done.stderr)
    assert len(lines) == 1, (what, done.stderr)
    for word in words:
        assert word in lines[0], (what, word, lines[0])
    assert not os.path.exists("bad/calibrated.osim"), what


def all_of(tests):
    """In a folder of their own, with three recordings of the person."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        make_motion("A", 1, 0.03)
        make_motion("B", 2, 0.15)
        make_motion("C", 3, 0.08)
        make_person("ABC")
        for test in tests:
            test()
