#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Walking: the shipped demos against their known motion; the same settings on a recorded trial against OpenSim.

    walking.py demo|trial|cvodes PATH/mhe-run PATH/mhe-model SOURCE_DIR     status 77: the trial is not there

cvodes: as the demo's simulated walk, with the motion integrated by CVODES (2 minutes; not part of ctest).

The trial (test data, not shipped) is OpenSim's gait10dof walk with what its inverse kinematics and inverse dynamics say. That
inverse dynamics low-passes coordinates (6 Hz, third order, both ways), loads stay raw. What the estimate's muscles and residual
torques make of the inertial forces is therefore low-passed the same way and compared with the inertial forces of OpenSim's own
coordinates, treated alike.
"""
import json
import math
import os
import subprocess
import sys
import tempfile

FROM, TO = 0.25, 2.25  # s: the ends of the recording are padding
LEGS = ["hip_flexion", "knee_angle", "ankle_angle"]
JOINTS = [name + side for side in ("_r", "_l") for name in LEGS] + ["lumbar_extension"]
FEET = [("calcn_r", ""), ("calcn_l", "1_")]
GAUSS = "{plugin: mhe.integrator.rk, scheme: gauss, stages: 2, max_step: 0.003, tolerance: 0}"
CVODES = "{plugin: mhe.integrator.sundials, rtol: 1e-6, atol: 1e-8}"
C1, C2 = (4 / 5, -1 / 5, 4 / 105, -1 / 280), (8 / 5, -1 / 5, 8 / 315, -1 / 560)


def table(path):
    with open(path) as file:
        lines = file.read().split("\n")
    i = next(k for k, line in enumerate(lines) if line.strip() == "endheader") + 1
    while not lines[i].strip():
        i += 1
    rows = [[float(x) for x in line.split()] for line in lines[i + 1:] if line.strip()]
    return {name: [row[k] for row in rows] for k, name in enumerate(lines[i].split())}


def at(t, times, values):
    low, high = 0, len(times) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if times[middle] <= t else (low, middle)
    part = (t - times[low]) / (times[high] - times[low])
    return values[low] + part * (values[high] - values[low])


def low_pass(y, h):
    """Third-order Butterworth of 6 Hz, forwards and backwards."""
    w = math.tan(math.pi * 6 * h)
    sections = [((w, w, 0), (1 + w, w - 1, 0)), ((w * w, 2 * w * w, w * w), (1 + w + w * w, 2 * (w * w - 1), 1 - w + w * w))]

    def run(x):
        for b, a in sections:
            b, a = [v / a[0] for v in b], [v / a[0] for v in a]
            z1, z2, out = x[0] * (1 - b[0]), x[0] * (b[2] - a[2]), []
            for v in x:
                out.append(b[0] * v + z1)
                z1, z2 = b[1] * v - a[1] * out[-1] + z2, b[2] * v - a[2] * out[-1]
            x = out
        return x

    n = min(len(y) - 1, int(0.5 / h))
    padded = [2 * y[0] - y[k] for k in range(n, 0, -1)] + y + [2 * y[-1] - y[-1 - k] for k in range(1, n + 1)]
    return run(run(padded)[::-1])[::-1][n:n + len(y)]


def rms(values):
    return math.sqrt(sum(x * x for x in values) / len(values))


class Runs:
    def __init__(self, arguments, work):
        self.run, self.model, self.source, self.work = *arguments, work
        self.good = True

    def expect(self, what, value, limit):
        print("%s: %.4g (at most %.4g)" % (what, value, limit))
        self.good &= value <= limit

    def estimate(self, setting, changes):
        out = os.path.join(self.work, setting)
        command = [self.run, os.path.join(self.source, "models", "gait10dof", "walk_%s.yaml" % setting), "--out", out, "--quiet"]
        subprocess.check_call(command + [word for change in changes for word in ("--set", change)], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
        with open(os.path.join(out, "summary.json")) as file:
            return out, json.load(file)

    def evaluate(self, model, poses):
        question, answer = os.path.join(self.work, "poses.json"), os.path.join(self.work, "answer.json")
        with open(question, "w") as file:
            json.dump({"poses": poses}, file)
        subprocess.check_call([self.model, "evaluate", model, "--poses", question, "--out", answer])
        with open(answer) as file:
            return [pose["inverse_dynamics"] for pose in json.load(file)["poses"]]


def demo(runs):
    truth = table(os.path.join(runs.source, "models", "gait10dof", "demo_walk_reference.sto"))
    for setting in ("follow", "consistent"):
        out, summary = runs.estimate(setting, [])
        forces = table(os.path.join(out, "forces.sto"))
        muscles = [name for name in forces if name != "time"]
        errors = [[f - at(t, truth["time"], truth["F_" + name]) for t, f in zip(forces["time"], forces[name])][5:-3]
                  for name in muscles]
        peak = max(max(truth["F_" + name]) for name in muscles)
        runs.expect(setting + ": windows not converged", 1 - summary["converged"], 0.01)
        runs.expect(setting + ": joint angles, deg", summary["rmse"]["q_deg"], 0.1)
        runs.expect(setting + ": forces, of the largest", math.sqrt(sum(rms(e)**2 for e in errors) / len(errors)) / peak, 0.02)
        runs.expect(setting + ": residual forces at the pelvis, of the load",
                    max(summary["residuals"][name]["share_of_load"] for name in ("pelvis_tx", "pelvis_ty")), 0.05)
        reactions = table(os.path.join(out, "reactions.sto"))
        hip = [reactions["hip_r_on_femur_r_in_femur_r_f" + axis] for axis in "xyz"]
        knee = max(math.sqrt(x * x + y * y + z * z) for x, y, z in zip(*hip))
        runs.expect("%s: the hip carries %.0f N, which is far from a walk's" % (setting, knee), abs(math.log(knee / 2000)), 0.7)
    wrong_loads(runs)
    simulated(runs, GAUSS)
    out, summary = runs.estimate("consistent", [  # the costs that the motion itself was made with
        "costs.0.sigma=0.0005", "costs.2.sigma=2", "costs.3.sigma=2", "costs.4.sigma=30"])
    forces = table(os.path.join(out, "forces.sto"))
    worst = max(rms([f - at(t, truth["time"], truth["F_" + name]) for t, f in zip(forces["time"], forces[name])][5:-3]) /
                max(truth["F_" + name]) for name in forces if name != "time")
    runs.expect("with the motion's own costs: the worst muscle's force, of its peak", worst, 0.02)


def simulated(runs, integrator):
    """A walk whose motion is integrated finely. A foot that comes off the ground is stiff: Gauss steps of 10 ms ring there, Radau's
    do not."""
    truth, demo_walk = os.path.join(runs.work, "simulated"), os.path.join(runs.source, "models", "gait10dof", "demo_walk_motion.yaml")
    subprocess.check_call([runs.run, demo_walk, "--out", truth, "--quiet", "--set", "integrator=" + integrator],
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    known = table(os.path.join(truth, "forces.sto"))
    out, summary = runs.estimate("consistent", [
        "data.markers=" + os.path.join(truth, "markers.trc"), "data.reference=", "costs.0.sigma=0.0005", "costs.2.sigma=2",
        "costs.3.sigma=2", "costs.4.sigma=30", "integrator.scheme=radau", "integrator.stages=2"])
    runs.expect("simulated: windows not converged", 1 - summary["converged"], 0.01)
    own = table(os.path.join(out, "forces.sto"))
    parts = {name: rms([f - at(t, known["time"], known[name]) for t, f in zip(own["time"], own[name])][5:-3]) / max(known[name])
             for name in own if name != "time"}
    worst = max(parts, key=parts.get)
    print("simulated: force of %d muscles, RMS of each one's own peak: mean %.4f, soleus %.4f %.4f" % (
        len(parts), sum(parts.values()) / len(parts), parts["soleus_r"], parts["soleus_l"]))
    runs.expect("simulated: the worst, %s of %.0f N" % (worst, max(known[worst])), parts[worst], 0.02)


def wrong_loads(runs):
    """What a base that floats is given beyond the loads is told, and named."""
    folder = os.path.join(runs.source, "models", "gait10dof")
    with open(os.path.join(folder, "demo_walk_loads.xml")) as file:
        description = file.read()
    with open(os.path.join(folder, "demo_walk_loads.sto")) as file:
        head, body = file.read().split("endheader\n")
    names, *rows = [line.split("\t") for line in body.split("\n") if line.strip()]
    cases = {  # which columns, factor, offset; what the verdict says
        "as_it_is": ("none", 1, 0, None),
        "no_left_foot": ("foot_l_v", 0, 0, "the residual force at pelvis_ty is"),
        "points_50_mm_ahead": ("px", 1, 0.05, "the residual moment at pelvis_tilt is"),
        "nine_tenths": ("_v", 0.9, 0, "the residual force at pelvis_ty is"),
        "shear_turned": ("vx", -1, 0, "the residual moment at pelvis_tilt is")}
    for name, (columns, factor, offset, said) in cases.items():
        which = [k for k, column in enumerate(names) if columns in column]
        path = os.path.join(runs.work, name)
        with open(path + ".sto", "w") as file:
            file.write(head + "endheader\n" + "\t".join(names) + "\n" + "".join("\t".join(
                repr(factor * float(x) + offset) if k in which else x for k, x in enumerate(row)) + "\n" for row in rows))
        with open(path + ".xml", "w") as file:
            file.write(description.replace("demo_walk_loads.sto", name + ".sto"))
        findings = runs.estimate("follow", ["data.external_loads=%s.xml" % path])[1]["verdict"]["findings"]
        told = [f["what"] for f in findings if f["weight"] != "note" and f["what"].startswith("the residual")]
        right = not told if said is None else any(what.startswith(said) for what in told)
        print("loads, %s: %s" % (name, "; ".join(told) or "nothing is said of them"))
        runs.good &= right


def inertial(runs, model, ik):
    """Inverse dynamics of OpenSim's coordinates without loads, and each pose."""
    names = [name for name in ik if name != "time"]
    h = (ik["time"][-1] - ik["time"][0]) / (len(ik["time"]) - 1)
    q = {n: [x * (1 if n[-3:-1] == "_t" else math.pi / 180) for x in ik[n]] for n in names}
    n_rows, poses = len(ik["time"]), []
    for n, f in q.items():  # turned over at the ends
        q[n] = [2 * f[0] - f[k] for k in range(4, 0, -1)] + f + [2 * f[-1] - f[-1 - k] for k in range(1, 5)]
    for k in range(4, n_rows + 4):
        pose = {"q": {}, "u": {}, "udot": {}}
        for n, f in q.items():
            pose["q"][n] = f[k]
            pose["u"][n] = sum(c * (f[k + j + 1] - f[k - j - 1]) for j, c in enumerate(C1)) / h
            pose["udot"][n] = (-205 / 72 * f[k] + sum(c * (f[k + j + 1] + f[k - j - 1]) for j, c in enumerate(C2))) / h**2
        poses.append(pose)
    moments = runs.evaluate(model, poses)
    return ik["time"], h, {n: low_pass([m[n] for m in moments], h) for n in names}


def load_moments(runs, model, motion, plates):
    times, poses = motion["time"], []
    for k, t in enumerate(times):
        pose = {"q": {n: motion[n][k] for n in motion if n != "time" and "." not in n}}
        loads = []
        for body, prefix in FEET:
            f, p, m = ([at(t, plates["time"], plates[prefix + "ground_" + kind + axis]) for axis in "xyz"]
                       for kind in ("force_v", "force_p", "torque_"))
            loads.append({"body": body, "force": f, "point": p, "torque": m})
        poses += [pose, dict(pose, external=loads)]
    moments = runs.evaluate(model, poses)
    return {n: [moments[2 * k][n] - moments[2 * k + 1][n] for k in range(len(times))] for n in moments[0]}


def trial(runs):
    shared = os.environ.get("MHE_SHARED", os.path.join(runs.source, "..", "shared"))
    folder = os.path.join(shared, "data", "walking", "gait10dof")
    if not os.path.isdir(folder):
        return 77
    ik, id_ = table(os.path.join(folder, "reference_IK.mot")), table(os.path.join(folder, "reference_ID.sto"))
    plates, model = table(os.path.join(folder, "subject01_walk_grf.mot")), os.path.join(folder, "subject01.osim")
    changes = ["data.markers=" + os.path.join(folder, "subject01_walk.trc"), "data.reference=",
               "data.external_loads=" + os.path.join(folder, "subject01_walk_grf.xml"),
               "data.marker_weights=" + os.path.join(folder, "setup_IK.xml"), "model.locked_at={}",
               "costs.5={plugin: mhe.cost.track, signal: residual_torque, value: [0], sigma: 30, of: [lumbar_extension]}"]
    markers = {}
    for setting in ("follow", "consistent"):
        out, summary = runs.estimate(setting, changes)
        runs.expect(setting + ": windows not converged", 1 - summary["converged"], 0.01)
        runs.expect(setting + ": frames without an answer", summary["frames"] - summary["n_window"] - summary["solves"], 0)
        markers[setting] = summary["channels"]["markers"]["rms"]
    runs.expect("consistent: residual forces at the pelvis, of the load",
                max(summary["residuals"][name]["share_of_load"] for name in ("pelvis_tx", "pelvis_ty")), 0.05)
    runs.expect("consistent: markers worse by, m", markers["consistent"] - markers["follow"], 0.005)
    out = os.path.join(runs.work, "follow")
    motion, torques = table(os.path.join(out, "motion.sto")), table(os.path.join(out, "torques.sto"))
    inner = [k for k, t in enumerate(motion["time"]) if FROM <= t <= TO]
    for name in JOINTS + ["pelvis_tilt"]:
        error = [math.degrees(motion[name][k]) - at(motion["time"][k], ik["time"], ik[name]) for k in inner]
        runs.expect("follow: %s, deg" % name, rms(error), 0.1)
    times, h, expected = inertial(runs, model, ik)
    loads = load_moments(runs, model, motion, plates)
    for name in JOINTS:
        own = low_pass([m + r + x for m, r, x in zip(torques["moment_" + name], torques["residual_" + name], loads[name])], h)
        off = max(abs(own[k] - at(motion["time"][k], times, expected[name])) for k in inner)
        peak = max(abs(x) for t, x in zip(id_["time"], id_[name + "_moment"]) if FROM <= t <= TO)
        runs.expect("follow: moment of %s, of its peak of %.0f N m" % (name, peak), off / peak, 0.05)
    return 0


def main():
    what, arguments = sys.argv[1], sys.argv[2:5]
    with tempfile.TemporaryDirectory() as work:
        runs = Runs(arguments, work)
        skipped = {"demo": demo, "trial": trial, "cvodes": lambda r: simulated(r, CVODES)}[what](runs)
    return skipped or (0 if runs.good else 1)


if __name__ == "__main__":
    sys.exit(main())
