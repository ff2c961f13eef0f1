#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a run of the abduction says about the shoulder.

    figures.py RESULTS                  reaction, residual torques, muscles that hold the girdle
    figures.py RESULTS --emg WITH_EMG   the same, and how far the activations of the muscles that RESULTS had no EMG of are
                                        from the EMG that the run WITH_EMG had of them (RMS)
    figures.py RESULTS --json           as JSON

RESULTS are those of a run with output.reactions: parent.
"""
import json
import math
import sys
from pathlib import Path

AXIS = (0.541, -0.126, 0.832)  # out of the glenoid, in the scapula; see README.md
LOADED = 100  # N
GIRDLE = {"serratus": ("SRA1", "SRA2", "SRA3"), "rhomboids": ("RMN", "RMJ1", "RMJ2"),
          "trapezius": ("TRPsup", "TRPsup_bis", "TRPmed", "TRPinf")}


def table(path):
    lines = Path(path).read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.strip() == "endheader") + 1
    names = lines[first].split("\t")
    rows = [[float(word) for word in line.split("\t")] for line in lines[first + 1:] if line.strip()]
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def reaction(folder, joint="glenohumeral", axis=AXIS):
    """Sizes (N) and angles (deg) of the humerus's reaction from the glenoid's axis, frame by frame."""
    of = table(folder / "reactions.sto")
    name = next(n[:-2] for n in of if n.startswith((joint, "humerus_parent_offset")) and n.endswith("in_scapula_fx"))
    sizes, angles = [], []
    for force in zip(*(of[name + axis] for axis in ("fx", "fy", "fz"))):
        size = math.sqrt(sum(f * f for f in force))
        along = sum(f * a for f, a in zip(force, axis)) / math.sqrt(sum(a * a for a in axis))
        if size > 0:
            sizes.append(size)
            angles.append(math.degrees(math.acos(max(-1.0, min(1.0, along / size)))))
    return sizes, angles


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def turned(degrees):
    """The axis turned forward, back, up and down in the scapula (x and y of the file, as far as they are across it)."""
    axis, across = unit(AXIS), []
    for along in ([1, 0, 0], [0, 1, 0]):
        for taken in [axis, *across]:
            dot = sum(a * t for a, t in zip(along, taken))
            along = [a - dot * t for a, t in zip(along, taken)]
        across.append(unit(along))
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {name: [c * a + s * sign * b for a, b in zip(axis, across[i])]
            for name, i, sign in (("forward", 0, 1), ("back", 0, -1), ("up", 1, 1), ("down", 1, -1))}


def within(folder, axis, limit=30):
    """Share of the loaded frames whose reaction is within `limit` degrees of the axis."""
    loaded = [a for s, a in zip(*reaction(folder, axis=axis)) if s > LOADED]
    return sum(a <= limit for a in loaded) / max(1, len(loaded))


def figures(folder, emg_of=None):
    folder = Path(folder)
    sizes, angles = reaction(folder)
    loaded = [a for s, a in zip(sizes, angles) if s > LOADED]
    torques, estimates = table(folder / "torques.sto"), table(folder / "estimates.sto")
    out = {"frames": len(estimates["time"]), "reaction_max": max(sizes), "loaded": len(loaded) / len(angles),
           "within_30": within(folder, AXIS),
           "within_30_turned": {str(d): {n: within(folder, a) for n, a in turned(d).items()} for d in (5, 10)},
           "angle_90": sorted(angles)[int(0.9 * len(angles))],
           "residuals": {n[len("residual_"):]: rms(v) for n, v in torques.items() if n.startswith("residual_")},
           "pushes": {n[len("actuator_"):]: 100 * sum(v) / len(v) for n, v in torques.items() if n.startswith("actuator_")},
           "girdle": {k: {m: sum(estimates["a_" + m]) / len(estimates["time"]) for m in of} for k, of in GIRDLE.items()}}
    if emg_of is not None:
        measured, here = table(Path(emg_of) / "emg.sto"), table(folder / "emg.sto")
        row = {round(t, 4): i for i, t in enumerate(measured["time"])}
        out["held_out"] = {}
        for muscle in [m for m in measured if m != "time"]:
            known = {t: measured[muscle][i] for t, i in row.items() if math.isfinite(measured[muscle][i])}
            if known and not any(math.isfinite(v) for v in here.get(muscle, [])):
                pairs = [(estimates["a_" + muscle][i], known[round(t, 4)])
                         for i, t in enumerate(estimates["time"]) if round(t, 4) in known]
                out["held_out"][muscle] = rms([a - e for a, e in pairs])
    return out


def fail(line):
    print("figures.py: " + line, file=sys.stderr)
    sys.exit(2)


def main():
    arguments = [a for a in sys.argv[1:] if a != "--json"]
    emg_of = None
    if len(arguments) == 3 and arguments[1] == "--emg":
        emg_of = arguments[2]
    elif len(arguments) != 1 or arguments[0].startswith("-"):
        fail("usage: figures.py RESULTS [--emg WITH_EMG] [--json]")
    try:
        out = figures(arguments[0], emg_of)
    except OSError as e:
        fail(f"{e.filename}: {e.strerror}; results of a run of stability.yaml with output.reactions: parent are wanted")
    except (ArithmeticError, LookupError, ValueError):
        fail(f"{arguments[0]}: not the results of a run of stability.yaml with output.reactions: parent")
    if "--json" in sys.argv:
        print(json.dumps(out, indent=1))
        return
    print(f"reaction: {100 * out['loaded']:.0f} % of {out['frames']} frames above {LOADED} N (at most {out['reaction_max']:.0f} N), "
          f"{100 * out['within_30']:.1f} % of them within 30 deg of the glenoid's axis; 90 % of all within {out['angle_90']:.0f} deg")
    for degrees, of in out["within_30_turned"].items():
        print(f"the same with the axis turned by {degrees} deg:", ", ".join(f"{n} {100 * v:.1f} %" for n, v in of.items()))
    print("residual torques, N m RMS:", ", ".join(f"{n} {v:.1f}" for n, v in out["residuals"].items()))
    print("the thorax on the scapula, N mean:", ", ".join(f"{n} {v:.0f}" for n, v in out["pushes"].items()) or "no actuators")
    for group, of in out["girdle"].items():
        print(f"{group}, mean activation:", ", ".join(f"{m} {a:.3f}" for m, a in of.items()))
    if "held_out" in out:
        print("EMG held out, RMS:", ", ".join(f"{m} {v:.4f}" for m, v in out["held_out"].items()))


if __name__ == "__main__":
    main()
