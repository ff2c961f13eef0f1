#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `mhe-model evaluate` says of joint reactions, against OpenSim's JointReaction of a walk.

    joint_reactions.py PATH/mhe-model SOURCE_DIR     status 77: the reference data are not there

Forces of muscles and residual actuators, kinematics and ground reaction are OpenSim's own. Its tools make velocities of
the coordinates by a quintic spline, and accelerations of the velocities by another; with 1 kHz of eight printed digits any
other way of differentiating is off by a newton and more. The right foot carries the left one's torque, as in the source.
"""
import json
import math
import os
import subprocess
import sys
import tempfile

# Of the recursive filter that gives a quintic B-spline's coefficients (Unser 1993, doi:10.1109/78.193220).
POLES = (math.sqrt(135 / 2 - math.sqrt(17745 / 4)) + math.sqrt(105 / 4) - 13 / 2,
         math.sqrt(135 / 2 + math.sqrt(17745 / 4)) - math.sqrt(105 / 4) - 13 / 2)
MARGIN = 25  # samples at the ends, where boundary conditions still matter
HIP = ["hip_r_on_femur_r_in_femur_r_" + c for c in ("fx", "fy", "fz", "mx", "my", "mz")]
RESIDUAL_POINT = (-0.0724376, 0, 0)  # of FX, FY, FZ in the pelvis; their directions are -x, -y, -z of ground


def table(path):
    with open(path) as file:
        lines = file.read().split("\n")
    i = next(k for k, line in enumerate(lines) if line.strip() == "endheader") + 1
    while not lines[i].strip():
        i += 1
    rows = [[float(x) for x in line.split()] for line in lines[i + 1:] if line.strip()]
    return {name: k for k, name in enumerate(lines[i].split())}, rows


def spline(f):
    gain = 1
    for z in POLES:
        gain *= (1 - z) * (1 - 1 / z)
    c = [x * gain for x in f]
    for z in POLES:
        c[0] = sum(c[k] * z**k for k in range(60))
        for k in range(1, len(c)):
            c[k] += z * c[k - 1]
        c[-1] = z / (z * z - 1) * (c[-1] + z * c[-2])
        for k in range(len(c) - 2, -1, -1):
            c[k] = z * (c[k + 1] - c[k])
    return c


def slopes(f, h):
    c = spline(f)
    inner = range(2, len(f) - 2)
    s = [(-c[k - 2] - 10 * c[k - 1] + 10 * c[k + 1] + c[k + 2]) / 24 / h for k in inner]
    return s[:1] * 2 + s + s[-1:] * 2


def row_at(rows, t):
    low, high = 0, len(rows) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if rows[middle][0] <= t else (low, middle)
    part = (t - rows[low][0]) / (rows[high][0] - rows[low][0])
    return [a + part * (b - a) for a, b in zip(rows[low], rows[high])]


class Walk:
    def __init__(self, program, folder, work):
        self.program, self.work = program, work
        self.model = os.path.join(folder, "subject01_simbody_adjusted_StaticOp.osim")
        names, kin = table(os.path.join(folder, "subject01_walk1_Kinematics.sto"))
        self.force_at, self.forces = table(os.path.join(folder, "reference_subject01_StaticOptimization_force.sto"))
        self.reference_at, reference = table(
            os.path.join(folder, "reference_subject01_JointReaction_ReactionLoads.sto"))
        self.load_at, self.loads = table(os.path.join(folder, "subject01_walk1_grf.mot"))
        h = kin[1][0] - kin[0][0]
        motion = {}
        for name, column in names.items():
            if name != "time":
                unit = 1 if name.endswith(("_tx", "_ty", "_tz")) else math.pi / 180
                q = [row[column] * unit for row in kin]
                u = slopes(q, h)
                motion[name] = (q, u, slopes(u, h))
        self.poses, self.expected = [], []
        for row in reference:
            k = round((row[0] - kin[0][0]) / h)
            if MARGIN <= k < len(kin) - MARGIN:
                pose = {key: {n: m[i][k] for n, m in motion.items()} for i, key in enumerate(("q", "u", "udot"))}
                pose["external"] = self.feet(row[0])
                self.poses.append(pose)
                self.expected.append(row)

    def feet(self, time):
        row = row_at(self.loads, time)

        def of(prefix):
            return [row[self.load_at[prefix + axis]] for axis in "xyz"]

        return [{"body": "calcn_" + side[0], "force": of(side + "_foot_force_v"), "point": of(side + "_foot_force_p"),
                 "torque": of("left_foot_torque_")} for side in ("right", "left")]

    def ask(self):
        question, answer = os.path.join(self.work, "poses.json"), os.path.join(self.work, "answer.json")
        with open(question, "w") as file:
            json.dump({"poses": self.poses}, file)
        subprocess.check_call([self.program, "evaluate", self.model, "--poses", question, "--out", answer],
                              stderr=subprocess.DEVNULL)
        with open(answer) as file:
            return json.load(file)["poses"]

    def add_forces(self):
        for pose, seen, row in zip(self.poses, self.ask(), self.expected):
            force = row_at(self.forces, row[0])
            pelvis = seen["bodies"]["pelvis"]
            point = [pelvis[i] + sum(pelvis[3 + 3 * i + j] * RESIDUAL_POINT[j] for j in range(3)) for i in range(3)]
            pose["external"].append({"body": "pelvis", "point": point,
                                     "force": [-force[self.force_at["F" + x]] for x in "XYZ"],
                                     "torque": [-force[self.force_at["M" + x]] for x in "XYZ"]})
            pose["forces"] = {n: force[self.force_at[n]] for n in seen["lines"] if n in self.force_at}


def main():
    program, source = sys.argv[1:3]
    shared = os.environ.get("MHE_SHARED", os.path.join(source, "..", "shared"))
    folder = os.path.join(shared, "data", "walking", "reactions")
    if not os.path.isdir(folder):
        return 77
    with tempfile.TemporaryDirectory() as work:
        walk = Walk(program, folder, work)
        walk.add_forces()
        worst, peak, root = dict.fromkeys(HIP, 0), dict.fromkeys(HIP, 0), 0
        for answer, row in zip(walk.ask(), walk.expected):
            frame, hip = answer["bodies"]["femur_r"][3:], answer["reactions"]["hip_r"]
            ours = [sum(frame[3 * i + j] * hip[part][i] for i in range(3)) for part in ("force", "moment") for j in range(3)]
            for name, value in zip(HIP, ours):
                expected = row[walk.reference_at[name]]
                worst[name] = max(worst[name], abs(value - expected))
                peak[name] = max(peak[name], abs(expected))
            ground = answer["reactions"]["ground_pelvis"]
            root = max([root] + [abs(x) for x in ground["force"] + ground["moment"]])
    for name in HIP:
        print("%s: peak %.1f, off by at most %.2g" % (name, peak[name], worst[name]))
    print("ground_pelvis: at most %.2g" % root)
    good = len(walk.poses) > 140 and root < 1e-3
    good &= all(worst[name] < 1e-5 * peak[name] for name in HIP[:3]) and all(worst[name] < 1e-3 for name in HIP[3:])
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
