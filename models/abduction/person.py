#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes an OpenSim model of the person of the recording out of its .bioMod file.

    person.py wu_scaled.bioMod person.osim [--arm FACTOR] [--as-it-is]

Bodies, joints, markers, muscles are those of the file, its massless segments composed into the joints between bodies
(thorax, clavicle, scapula, humerus, ulna, radius, hand_r; joint `glenohumeral` carries the humerus). What is changed
unless --as-it-is is said:

- The arm's masses and inertias times FACTOR (0.55): 3.8 kg, 5 % of a body of 75 kg, which is what an arm is (Winter,
  Biomechanics and Motor Control of Human Movement, table 4.1). As it is the arm has 6.9 kg.
- Muscles whose fibres leave 0.5 to 1.5 optimal lengths in the recorded motion: both lengths times one factor, so that
  the fibre is at its optimal length in the middle of what the motion asks for. The ranges are those of RANGES.
- The thorax pushes on the scapula: three actuators that only push, at the root of the spine, the middle of the medial
  border and the inferior angle, at right angles to the plane of the three and the joint's centre's side away from the
  ribs (van der Helm 1994, doi:10.1016/0021-9290(94)90025-6, holds the border's two ends to the thorax likewise).
"""
import math
import re
import sys

# Lengths of the paths in the motion (m), shortest and longest, of the muscles that need other lengths.
RANGES = {"LVS": (0.0588, 0.0905),
          "RMN": (0.0459, 0.0626),
          "RMJ1": (0.0388, 0.0512),
          "RMJ2": (0.0381, 0.0720),
          "SRA1": (0.1324, 0.1793),
          "SRA2": (0.1591, 0.1982),
          "SRA3": (0.1838, 0.2148),
          "TRPsup": (0.0531, 0.1413),
          "SBCL": (0.0864, 0.1018)}
ARM = ("humerus", "ulna", "radius", "hand_r")
JOINTS = {"clavicle": "sternoclavicular", "scapula": "acromioclavicular", "humerus": "glenohumeral",
          "ulna": "elbow", "radius": "radioulnar", "hand_r": "wrist", "thorax": "trunk"}


# ---- the file ----

def blocks(text):
    """(kind, name, {key: words}) of segments, markers, groups, muscles, points, in their order."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r"//[^\n]*", "", text)
    kinds = r"segment|marker|musclegroup|muscle|viapoint"
    for m in re.finditer(rf"^[ \t]*({kinds})[ \t]+(\S+)[ \t]*\n(.*?)^[ \t]*end\1", text, re.S | re.M):
        yield m.group(1), m.group(2), m.group(3)


def field(body, key, n=None):
    m = re.search(rf"^\s*{key}\s+((?:[^\n]+\n?))", body, re.M | re.I)
    if m is None:
        return None
    if n is None:
        return m.group(1).split()[0]
    words = body[m.start(1):].split()
    return [float(w) for w in words[:n]]


# ---- transforms: (R, p), R as rows ----

def product(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turned(R, v):
    return [sum(R[i][k] * v[k] for k in range(3)) for i in range(3)]


def then(a, b):
    return product(a[0], b[0]), [x + y for x, y in zip(a[1], turned(a[0], b[1]))]


def inverse(a):
    R = [[a[0][j][i] for j in range(3)] for i in range(3)]
    return R, [-x for x in turned(R, a[1])]


def about(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    R = [[0.0] * 3 for _ in range(3)]
    R[i][i], R[j][j], R[k][k], R[j][k], R[k][j] = 1.0, c, c, -s, s
    return R


ONE = ([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]], [0.0, 0, 0])


def frame(body):
    """RT of a segment."""
    if (field(body, "RTinMatrix") or "1") == "1":
        words = field(body, "RT", 16)
        return ([words[0:3], words[4:7], words[8:11]], [words[3], words[7], words[11]])
    words = re.search(r"^\s*RT\s+(.*)", body, re.M).group(1).split()
    R = ONE[0]
    for letter, angle in zip(words[3], words[:3]):
        R = product(R, about("xyz".index(letter), float(angle)))
    return R, [float(w) for w in words[4:7]]


def angles(R):
    """Body-fixed x, y, z."""
    return [math.atan2(-R[1][2], R[2][2]), math.asin(max(-1.0, min(1.0, R[0][2]))), math.atan2(-R[0][1], R[0][0])]


# ---- what is written ----

def text(values):
    return " ".join("%.15g" % v for v in values)


def offset(name, parent, where):
    socket = "/ground" if parent == "ground" else f"/bodyset/{parent}"
    return (f'<PhysicalOffsetFrame name="{name}"><socket_parent>{socket}</socket_parent>'
            f"<translation>{text(where[1])}</translation><orientation>{text(angles(where[0]))}</orientation>"
            "</PhysicalOffsetFrame>")


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    size = math.sqrt(sum(x * x for x in a))
    return [x / size for x in a]


def joint_axis(k, kind, axis, coordinate):
    if coordinate is None:
        function = "<Constant><value>0</value></Constant>"
    else:
        function = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
    return (f'<TransformAxis name="{kind}{k + 1}"><coordinates>{coordinate or ""}</coordinates>'
            f"<axis>{text(axis)}</axis><function>{function}</function></TransformAxis>")


def joint(name, parent, child, before, turns, after):
    """turns: (axis in the joint's frame, coordinate, lower, upper); after: from the joint's frame to the child's."""
    frames = (f"<socket_parent_frame>of_{parent}</socket_parent_frame><socket_child_frame>of_{child}</socket_child_frame>")
    offsets = "<frames>" + offset(f"of_{parent}", parent, before) + offset(f"of_{child}", child, inverse(after)) + "</frames>"
    if not turns:
        return f'<WeldJoint name="{name}">{frames}{offsets}</WeldJoint>\n'
    coordinates = "".join(
        f'<Coordinate name="{c}"><default_value>0</default_value><default_speed_value>0</default_speed_value>'
        f"<range>{lower:.15g} {upper:.15g}</range></Coordinate>" for _, c, lower, upper in turns)
    axes = [t[0] for t in turns]
    while len(axes) < 3:  # constant ones at right angles
        first = axes[0]
        other = axes[1] if len(axes) > 1 else ([0, 1, 0] if abs(first[1]) < 0.9 else [1, 0, 0])
        axes.append(unit(cross(first, other)))
    names = [t[1] for t in turns] + [None] * 3
    spatial = "".join(joint_axis(k, "rotation", axes[k], names[k]) for k in range(3))
    spatial += "".join(joint_axis(k, "translation", [float(i == k) for i in range(3)], None) for k in range(3))
    return (f'<CustomJoint name="{name}">{frames}<coordinates>{coordinates}</coordinates>{offsets}'
            f"<SpatialTransform>{spatial}</SpatialTransform></CustomJoint>\n")


def skeleton(text_of_file, arm):
    """Bodies and joints as XML, and where each segment's points are: {segment: (body, transform)}."""
    bodies, joints, place = [], [], {}
    pending = {}  # segment without mass: (body, before, turns, after)
    for kind, name, body in blocks(text_of_file):
        if kind != "segment":
            continue
        parent = field(body, "parent") or "ground"
        own = frame(body)
        start = ("ground", ONE, [], ONE) if parent in ("ground", "root") else pending.get(parent, (parent, ONE, [], ONE))
        of, before, turns, after = start
        turns = list(turns)
        if turns:
            after = then(after, own)
        else:
            before = then(before, own)
        letters = field(body, "rotations") or ""
        numbers = [float(w) for w in re.findall(r"-?[\d.]+(?:e-?\d+)?", re.split(r"ranges", body)[1])] if "ranges" in body else []
        for i, letter in enumerate(letters):
            axis = [after[0][r]["xyz".index(letter)] for r in range(3)] if turns else [float("xyz"[r] == letter) for r in range(3)]
            turns.append((axis, f"{name}_Rot{letter.upper()}", *(numbers[2 * i:2 * i + 2] or (-math.pi, math.pi))))
        mass = field(body, "mass")
        if mass is None:
            pending[name] = (of, before, turns, after)
            continue
        factor = arm if name in ARM else 1.0
        inertia = field(body, "inertia", 9)
        bodies.append(f'<Body name="{name}"><mass>{factor * float(mass):.15g}</mass>'
                      f'<mass_center>{text(field(body, "com", 3))}</mass_center>'
                      f"<inertia>{text([factor * inertia[k] for k in (0, 4, 8, 1, 2, 5)])}</inertia></Body>\n")
        joints.append(joint(JOINTS.get(name, name + "_joint"), of, name, before, turns, after))
        place[name] = name
    return bodies, joints


def point(name, body, at):
    return (f'<PathPoint name="{name}"><socket_parent_frame>/bodyset/{body}</socket_parent_frame>'
            f"<location>{text(at)}</location></PathPoint>")


def muscles(text_of_file, as_it_is):
    groups, list_of, via = {}, [], {}
    for kind, name, body in blocks(text_of_file):
        if kind == "musclegroup":
            groups[name] = field(body, "OriginParent"), field(body, "InsertionParent")
        elif kind == "muscle":
            list_of.append((name, body))
        elif kind == "viapoint":
            via.setdefault(field(body, "muscle"), []).append((name, field(body, "parent"), field(body, "position", 3)))
    out = []
    for name, body in list_of:
        origin, insertion = groups[field(body, "musclegroup")]
        fiber, tendon = float(field(body, "optimalLength")), float(field(body, "tendonSlackLength"))
        if name in RANGES and not as_it_is:
            factor = 0.5 * sum(RANGES[name]) / (fiber + tendon)
            fiber, tendon = factor * fiber, factor * tendon
        points = [point(f"{name}-o", origin, field(body, "OriginPosition", 3))]
        points += [point(n, p, at) for n, p, at in via.get(name, [])]
        points += [point(f"{name}-i", insertion, field(body, "InsertionPosition", 3))]
        out.append(f'<DeGrooteFregly2016Muscle name="{name}"><GeometryPath><PathPointSet><objects>{"".join(points)}'
                   "</objects></PathPointSet></GeometryPath>"
                   f'<max_isometric_force>{float(field(body, "maximalForce")):.15g}</max_isometric_force>'
                   f"<optimal_fiber_length>{fiber:.15g}</optimal_fiber_length>"
                   f"<tendon_slack_length>{tendon:.15g}</tendon_slack_length>"
                   f'<pennation_angle_at_optimal>{float(field(body, "pennationAngle")):.15g}</pennation_angle_at_optimal>'
                   "<max_contraction_velocity>10</max_contraction_velocity></DeGrooteFregly2016Muscle>\n")
    return out


def contacts(at, centre):
    """The thorax on the scapula: `at` three points of its border, `centre` that of the shoulder joint."""
    top, middle, bottom = at
    normal = unit(cross([a - b for a, b in zip(centre, top)], [a - b for a, b in zip(bottom, top)]))
    if normal[0] > 0:  # x points forward: away from the ribs is backward
        normal = [-x for x in normal]
    return [f'<PointActuator name="thorax_on_{name}"><body>scapula</body><point>{text(p)}</point>'
            "<point_is_global>false</point_is_global>"
            f"<direction>{text(normal)}</direction><force_is_global>false</force_is_global>"
            "<optimal_force>100</optimal_force><min_control>0</min_control><max_control>5</max_control></PointActuator>\n"
            for name, p in zip(("spine", "border", "angle"), (top, middle, bottom))]


def model(source, arm, as_it_is):
    bodies, joints = skeleton(source, arm)
    ends, centre, markers = {}, None, []
    for kind, name, body in blocks(source):
        if kind == "marker":
            markers.append(f'<Marker name="{name}"><socket_parent_frame>/bodyset/{field(body, "parent")}</socket_parent_frame>'
                           f'<location>{text(field(body, "position", 3))}</location><fixed>true</fixed></Marker>\n')
        elif kind == "muscle" and name in ("RMN", "SRA2", "RMJ2"):
            ends[name] = field(body, "InsertionPosition", 3)
        elif kind == "segment" and name == "humerus_parent_offset":
            centre = frame(body)[1]
    forces = muscles(source, as_it_is)
    if not as_it_is:
        forces += contacts([ends[n] for n in ("RMN", "SRA2", "RMJ2")], centre)
    gravity = re.search(r"^gravity\s+(.*)", source, re.M).group(1).split()
    lists = [("BodySet", "bodyset", bodies), ("JointSet", "jointset", joints), ("ForceSet", "forceset", forces),
             ("MarkerSet", "markerset", markers)]
    return ('<?xml version="1.0" encoding="UTF-8"?>\n<OpenSimDocument Version="40000">\n<Model name="person">\n'
            f"<length_units>meters</length_units><force_units>N</force_units><gravity>{' '.join(gravity)}</gravity>\n"
            '<Ground name="ground"/>\n'
            + "".join(f'<{kind} name="{name}"><objects>\n{"".join(things)}</objects></{kind}>\n' for kind, name, things in lists)
            + "</Model>\n</OpenSimDocument>\n")


def fail(line):
    print("person.py: " + line, file=sys.stderr)
    sys.exit(2)


def main():
    arguments = sys.argv[1:]
    as_it_is = "--as-it-is" in arguments
    arm = 1.0 if as_it_is else 0.55
    if "--arm" in arguments:
        at = arguments.index("--arm")
        try:
            arm = float(arguments[at + 1])
        except (IndexError, ValueError):
            arm = math.nan
        if not 0 < arm < math.inf:
            fail("--arm: a factor above 0, as 0.55")
        del arguments[at:at + 2]
    arguments = [a for a in arguments if a != "--as-it-is"]
    if len(arguments) != 2:
        fail("usage: person.py wu_scaled.bioMod person.osim [--arm FACTOR] [--as-it-is]")
    try:
        with open(arguments[0], encoding="utf-8") as f:
            text = model(f.read(), arm, as_it_is)
        with open(arguments[1], "w", encoding="utf-8") as f:
            f.write(text)
    except OSError as e:
        fail(f"{e.filename}: {e.strerror}")
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        fail(f"{arguments[0]}: not the .bioMod of the recording (README.md says where it is from)")


if __name__ == "__main__":
    main()
