#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Recorded walks with whole-body models, against what OpenSim's own tools say of them.

    walking_trials.py gait2392|walk3d|static PATH/mhe-run PATH/mhe-model SOURCE_DIR [KEEP_DIR]   status 77: the trial is not there

gait2392: the reference was made with the markers where OpenSim's Scale tool put them on this person (scaling/
reference_subject01_simbody.osim), not where the model file has them: with those places the reference minimises its own
task's squares (knee_angle_l would be 4 degrees off else). Subtalar and metatarsal joints stay where the reference has them.

walk3d: the coordinates are the source's inverse kinematics on another fit of the model, changed by residual reduction, so
markers alone cannot give them. They are taken as measured angles, low-passed (6 Hz, both ways) as its inverse dynamics had
them, and the metatarsal joints are welded, as they were there.

static: forces and joint reactions beside OpenSim's static optimisation (least squares of activations, rigid tendons, no
passive forces). With KEEP_DIR also the figure of docs/walking.md, static.svg (gnuplot).
"""
import json
import math
import os
import re
import subprocess
import sys
import tempfile

from walking import Runs, at, low_pass, rms, table

NO_MUSCLE = ["pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz", "lumbar_extension",
             "lumbar_bending", "lumbar_rotation"] + [a + s for s in ("_r", "_l") for a in (
                 "arm_flex", "arm_add", "arm_rot", "elbow_flex", "pro_sup")]
LEGS = [a + s for s in ("_r", "_l") for a in ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")]
CHANNELS = {"soleus": ["soleus_r"], "gastrocnemius": ["gasmed_r", "gaslat_r"], "tibialis_anterior": ["tibant_r"],
            "medial_hamstrings": ["semimem_r", "semiten_r"], "biceps_femoris": ["bflh_r"], "vastus_lateralis": ["vaslat_r"],
            "vastus_medius": ["vasmed_r"], "rectus_femoris": ["recfem_r"],
            "gluteus_maximus": ["glmax1_r", "glmax2_r", "glmax3_r"], "gluteus_medius": ["glmed1_r", "glmed2_r", "glmed3_r"]}
TRACK = "  - {plugin: mhe.cost.track, signal: %s}\n"
COMMON = """formulation: activation
bounds: {residual_torques: true, residual_torque_max: 1000, activation_min: 0.01}
integrator: {plugin: mhe.integrator.rk, scheme: gauss, stages: 1, max_step: 0.02, tolerance: 0}
solver: {plugin: mhe.solver.rti, preset: balanced}
horizon: {window: 7, ratio: 1}
"""


def read(path):
    with open(path) as file:
        return file.read()


def run(runs, name, text):
    config, out = os.path.join(runs.work, name + ".yaml"), os.path.join(runs.work, name)
    with open(config, "w") as file:
        file.write(COMMON + text)
    subprocess.check_call([runs.run, config, "--out", out, "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(os.path.join(out, "summary.json")) as file:
        summary = json.load(file)
    print("%s: %.1f %% of %d windows converged, %.1f ms median, %.0f MB" % (
        name, 100 * summary["converged"], summary["solves"], summary["solve_ms"]["p50"], summary["peak_rss_mb"]))
    return out, summary


def places(text):
    """Where a model file's markers are: the text of each location."""
    markers = re.findall(r'<Marker name="([^"]+)">.*?<location>([^<]+)<', text[text.index("<MarkerSet"):], re.S)
    return dict(markers)


def with_places(text, where):
    start = text.index("<MarkerSet")
    return text[:start] + re.sub(
        r'(<Marker name="([^"]+)">.*?<location>)[^<]+<', lambda m: m[1] + where.get(m[2], "0 0 0") + "<", text[start:], flags=re.S)


def gait2392(runs, folder):
    trial, own = os.path.join(folder, "gait10dof"), os.path.join(folder, "gait2392")
    model = os.path.join(runs.work, "placed.osim")
    with open(model, "w") as file:
        file.write(with_places(read(os.path.join(own, "subject01_simbody.osim")),
                               places(read(os.path.join(folder, "scaling", "reference_subject01_simbody.osim")))))
    out, summary = run(runs, "gait2392", "model: {file: %s, unsupported: warn, locked_at: {subtalar_angle_r: 0.08802, "
                       "subtalar_angle_l: 0.26398, mtp_angle_r: 0, mtp_angle_l: 0}}\nmuscle: {passive: 0.1}\n"
                       "data: {markers: %s, rates: true, external_loads: %s, marker_weights: %s}\ncosts:\n" % (
                           model, os.path.join(trial, "subject01_walk.trc"), os.path.join(own, "subject01_walk1_grf.xml"),
                           os.path.join(own, "subject01_Setup_IK.xml")) +
                       TRACK % "markers, sigma: 0.001" + TRACK % "activation, value: [0], sigma: 0.3" +
                       TRACK % "residual_torque, value: [0], sigma: 10" + TRACK % "qdot, sigma: 1")
    runs.expect("gait2392: windows not converged", 1 - summary["converged"], 0.02)
    motion, ik = table(os.path.join(out, "motion.sto")), table(os.path.join(own, "subject01_walk1_ik.mot"))
    for name in [n for n in ik if n in motion and n != "time"]:
        unit = 1 if name[-3:-1] == "_t" else 180 / math.pi
        error = [unit * q - at(t, ik["time"], ik[name]) for t, q in zip(motion["time"], motion[name]) if 0.6 <= t <= 1.5]
        runs.expect("gait2392: %s, %s" % (name, "m" if unit == 1 else "deg"), rms(error), 0.005 if unit == 1 else 0.5)
    report_moments(out, os.path.join(own, "reference_ID.sto"), 0.6, 1.5)


def moments_off(out, reference, start, end):
    """Largest difference of muscles and residuals from inverse dynamics, and its peak."""
    torques, id_ = table(os.path.join(out, "torques.sto")), table(reference)
    off = {}
    for column in id_:
        name = re.sub("_(moment|force)$", "", column)
        if name == column or "moment_" + name not in torques:
            continue
        sums = [(t, m + r) for t, m, r in zip(torques["time"], torques["moment_" + name], torques["residual_" + name])]
        worst = max(abs(m - at(t, id_["time"], id_[column])) for t, m in sums if start <= t <= end)
        off[name] = worst, max(abs(x) for t, x in zip(id_["time"], id_[column]) if start <= t <= end)
    return off


def report_moments(out, reference, start, end):
    off = moments_off(out, reference, start, end)
    print("moments, largest difference of peak: " + ", ".join("%s %.0f of %.0f" % (n, *off[n]) for n in off))


def every_tenth(source, target, smooth):
    """Angles at 100 of their 1 000 Hz; smooth: as inverse dynamics had them, 6 Hz, third order, both ways."""
    lines = read(source).split("\n")
    head = next(k for k, line in enumerate(lines) if line.startswith("endheader")) + 2
    rows = [[float(x) for x in line.split()] for line in lines[head:] if line.strip()]
    h, columns = rows[1][0] - rows[0][0], list(zip(*rows))
    if smooth:
        columns = [columns[0]] + [low_pass(list(column), h) for column in columns[1:]]
    kept = list(zip(*columns))[::10]
    with open(target, "w") as file:
        file.write("\n".join([re.sub("nRows=.*", "nRows=%d" % len(kept), line) for line in lines[:head]] +
                             ["\t".join("%.10g" % x for x in row) for row in kept]) + "\n")


def walk3d_text(folder, data, channels, first):
    text = "model: {file: %s, unsupported: warn, locked_at: {mtp_angle_r: 0, mtp_angle_l: 0}}\n" % os.path.join(
        folder, "subject_walk_scaled.osim")
    text += "data: {%s, rates: true, external_loads: %s%s}\n" % (
        data, os.path.join(folder, "grf_walk.xml"),
        "" if not channels else ", emg: " + os.path.join(folder, "electromyography.sto"))
    if channels:
        text += "emg:\n  process: false\n  channels:\n" + "".join(
            "    - {name: %s, muscles: [%s], gain: %.3f}\n" % (name, ", ".join(CHANNELS[name]), gain)
            for name, gain in channels.items())
    text += "costs:\n" + first + TRACK % "activation, value: [0], sigma: 0.3"
    text += TRACK % ("residual_torque, value: [0], sigma: 1000, of: [%s]" % ", ".join(NO_MUSCLE))
    text += TRACK % ("residual_torque, value: [0], sigma: 3, of: [%s]" % ", ".join(LEGS))
    return text + (TRACK % "activation, sigma: 0.1" if channels else "")


def activations(out, emg):
    """EMG and activation of each muscle with a channel, at the estimates."""
    rows = table(os.path.join(out, "estimates.sto"))
    inner = [k for k, t in enumerate(rows["time"]) if 0.5 <= t <= 1.75]
    at_rows = {name: [at(rows["time"][k], emg["time"], emg[name]) for k in inner] for name in CHANNELS}
    return {(name, m): (at_rows[name], [rows["a_" + m][k] for k in inner]) for name in CHANNELS for m in CHANNELS[name]}


def correlation(x, y):
    mx, my = sum(x) / len(x), sum(y) / len(y)
    covariance = sum((a - mx) * (b - my) for a, b in zip(x, y))
    return covariance / math.sqrt(sum((a - mx)**2 for a in x) * sum((b - my)**2 for b in y))


def angle_errors(out, coordinates):
    """RMS of each rotation over 0.5 .. 1.75 s, and the same without its mean, deg."""
    motion = table(os.path.join(out, "motion.sto"))
    errors = {}
    for column in coordinates:
        name = column.split("/")[-2] if column.endswith("/value") else None
        if name in motion and name[-3:-1] != "_t" and not name.endswith("_beta"):
            d = [math.degrees(q - at(t, coordinates["time"], coordinates[column]))
                 for t, q in zip(motion["time"], motion[name]) if 0.5 <= t <= 1.75]
            mean = sum(d) / len(d)
            errors[name] = rms(d), rms([x - mean for x in d])
    return errors


def walk3d(runs, folder):
    folder = os.path.join(folder, "walk3d")
    angles, emg = os.path.join(runs.work, "angles.sto"), table(os.path.join(folder, "electromyography.sto"))
    coordinates = table(os.path.join(folder, "coordinates.sto"))
    every_tenth(os.path.join(folder, "coordinates.sto"), angles, True)
    tight = TRACK % "q, sigma: 0.001" + TRACK % "qdot, sigma: 0.02"
    least, _ = run(runs, "least", walk3d_text(folder, "angles: " + angles, {}, tight))
    least = activations(least, emg)
    gains = {}
    for name in CHANNELS:  # a channel's scale: what the least excitation makes of it
        pairs = [least[name, m] for m in CHANNELS[name]]
        gain = sum(a * e for e_, a_ in pairs for e, a in zip(e_, a_)) / sum(e * e for e_, _ in pairs for e in e_)
        gains[name] = min(max(gain, 0.2), 1)
    out, summary = run(runs, "walk3d", walk3d_text(folder, "angles: " + angles, gains, tight))
    runs.expect("walk3d: windows not converged", 1 - summary["converged"], 0.01)
    errors = angle_errors(out, coordinates)
    runs.expect("walk3d: %d angles, deg, mean of RMS" % len(errors), sum(e[0] for e in errors.values()) / len(errors), 1.5)
    for name, (off, peak) in moments_off(out, os.path.join(folder, "id_walk.sto"), 0.5, 1.75).items():
        if name.startswith("pelvis"):
            print("walk3d: residual at %s is %.1f N (N m) from OpenSim's of %.0f at most" % (name, off, peak))
        elif not name.endswith("_beta"):
            runs.expect("walk3d: moment of %s, of its peak of %.1f N m" % (name, peak), off / peak, 0.1)
    torques = table(os.path.join(out, "torques.sto"))
    print("residual torque, RMS, N m: " + ", ".join("%s %.1f" % (n, rms(torques["residual_" + n])) for n in LEGS))
    with_emg = activations(out, emg)
    for key in with_emg:
        print("%s (%s, gain %.2f): correlation of EMG and activation %.2f, least excitation %.2f" % (
            key[1], key[0], gains[key[0]], correlation(*with_emg[key]), correlation(*least[key])))
    markers = "markers: %s, marker_weights: %s" % (os.path.join(folder, "markers_walk.trc"),
                                                   os.path.join(folder, "ik_tasks_walk.xml"))
    out, summary = run(runs, "markers", walk3d_text(folder, markers, gains, TRACK % "markers, sigma: 0.002" +
                                                    TRACK % "qdot, sigma: 0.5"))
    runs.expect("walk3d by markers: windows not converged", 1 - summary["converged"], 0.01)
    errors = angle_errors(out, coordinates)
    print("walk3d by markers: angles %.2f deg, mean of RMS; without each one's mean %.2f" % tuple(
        sum(e[i] for e in errors.values()) / len(errors) for i in (0, 1)))


SHOWN = ["soleus_r", "med_gas_r", "tib_ant_r", "vas_lat_r", "rect_fem_r", "semimem_r", "glut_med1_r", "psoas_r"]
REACTION = "hip_r_on_femur_r_in_femur_r_f"


def draw(folder, times, pairs):
    """pairs: title -> (ours, OpenSim's)."""
    with open(os.path.join(folder, "static.dat"), "w") as file:
        for k, t in enumerate(times):
            file.write("%.3f %s\n" % (t, " ".join("%.1f %.1f" % (a[k], b[k]) for a, b in pairs.values())))
    plots = "".join('set title "%s" noenhanced\nplot "static.dat" u 1:%d w l lw 2 lc rgb "#d95f02" t "OpenSim", "" u 1:%d w l lw 2 '
                    'lc rgb "#1f77b4" t "Myohorizon"\nunset key\n' % (title, 2 * i + 3, 2 * i + 2)
                    for i, title in enumerate(pairs))
    with open(os.path.join(folder, "static.gp"), "w") as file:
        file.write('set terminal svg size 1000,760 font "sans,11" background "white"\nset output "static.svg"\n'
                   'set multiplot layout 4,3 margins 0.06,0.98,0.06,0.95 spacing 0.05,0.1\n'
                   'set xrange [0.5:1.95]\nset xtics 0.5\nset tics font ",9"\nset key top left samplen 1.5\n' + plots + "unset multiplot\n")
    subprocess.check_call(["gnuplot", "static.gp"], cwd=folder)


def static(runs, folder):
    folder = os.path.join(folder, "reactions")
    angles = os.path.join(runs.work, "angles.sto")
    every_tenth(os.path.join(folder, "subject01_walk1_Kinematics.sto"), angles, False)
    with_muscles = [n for n in LEGS] + ["subtalar_angle_r", "subtalar_angle_l"] + NO_MUSCLE[6:9]
    out, summary = run(runs, "static", "model: {file: %s, unsupported: warn, locked_at: {mtp_angle_r: 0, mtp_angle_l: 0}}\n"
                       "muscle: {passive: 0}\ndata: {angles: %s, rates: true, external_loads: %s}\noutput: {reactions: child}\n"
                       "costs:\n" % (os.path.join(folder, "subject01_simbody_adjusted_StaticOp.osim"), angles,
                                     os.path.join(folder, "foot_floor_loads.xml")) +
                       TRACK % "q, sigma: 0.001" + TRACK % "qdot, sigma: 0.02" + TRACK % "activation, value: [0], sigma: 0.3" +
                       TRACK % ("residual_torque, value: [0], sigma: 1000, of: [%s]" % ", ".join(NO_MUSCLE[:6])) +
                       TRACK % ("residual_torque, value: [0], sigma: 1, of: [%s]" % ", ".join(with_muscles)))
    runs.expect("static: windows not converged", 1 - summary["converged"], 0.01)
    own = table(os.path.join(out, "forces.sto"))
    other = table(os.path.join(folder, "reference_subject01_StaticOptimization_force.sto"))
    inner = [k for k, t in enumerate(own["time"]) if 0.55 <= t <= 1.9]
    times, squares, largest, pairs = [own["time"][k] for k in inner], [], 0, {}
    for name in own:
        if name == "time":
            continue
        a, b = [own[name][k] for k in inner], [at(t, other["time"], other[name]) for t in times]
        squares.append(sum((x - y)**2 for x, y in zip(a, b)) / len(a))
        largest = max(largest, max(b))
        if name in SHOWN:
            pairs[name + ", N"] = a, b
            print("static: %s RMS %.0f N of a peak of %.0f N, correlation %.3f" % (
                name, math.sqrt(squares[-1]), max(b), correlation(a, b)))
    runs.expect("static: forces of %d muscles, RMS of the largest of %.0f N" % (len(squares), largest),
                math.sqrt(sum(squares) / len(squares)) / largest, 0.02)
    own = table(os.path.join(out, "reactions.sto"))
    other = table(os.path.join(folder, "reference_subject01_JointReaction_ReactionLoads.sto"))
    for axis in "xyz":
        column = next(n for n in other if n.endswith(REACTION + axis))
        a, b = [own[REACTION + axis][k] for k in inner], [at(t, other["time"], other[column]) for t in times]
        peak = max(abs(x) for x in b)
        runs.expect("static: reaction of hip_r, %s, RMS of its peak of %.0f N" % (axis, peak),
                    rms([x - y for x, y in zip(a, b)]) / peak, 0.05)
        pairs["hip_r on femur_r, %s, N" % axis] = a, b
    if len(sys.argv) > 5:
        draw(runs.work, times, pairs)


def main():
    what, arguments, keep = sys.argv[1], sys.argv[2:5], sys.argv[5:]
    shared = os.environ.get("MHE_SHARED", os.path.join(arguments[2], "..", "shared"))
    folder = os.path.join(shared, "data", "walking")
    if not os.path.isdir(folder):
        return 77
    with tempfile.TemporaryDirectory() as work:
        runs = Runs(arguments, keep[0] if keep else work)
        {"gait2392": gait2392, "walk3d": walk3d, "static": static}[what](runs, folder)
    return 0 if runs.good else 1


if __name__ == "__main__":
    sys.exit(main())
