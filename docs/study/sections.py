# SPDX-License-Identifier: Apache-2.0
"""The blocks of the page: tables in Markdown of what mhe-study report made, by the names that the page calls them."""
import sys

from compare import EMG_LEVELS, LEVELS, STATEMENTS, TRACKING, Missing, Study, WrongTable, number, table


def verdicts(part):
    def block(folder):
        rows = []
        for statement in STATEMENTS[part]:
            try:
                rows.append(statement(folder))
            except Missing:
                continue
            except WrongTable as why:  # a shortened study
                print(f"left out: {statement.__name__}: {why}", file=sys.stderr)
        return table(["paper", "here", "verdict"], rows) if rows else ""
    return block


# ---- tables of the sections ----

def rates(folder):
    rows = Study(folder, "window").rows(ratios=["authors", "every"])
    return table(["formulation", "window", "every nth sample", "rate (Hz)", "q (deg)", "force (N)", "markers (mm)"],
                 [[r["formulation"], *r["horizon"].split("/"), f"{r['rate_hz']:.0f}", number(r["q_deg"]), number(r["force_n"]),
                   number(r["marker_mm"])] for r in rows])


def forces(folder):
    study = Study(folder, "noise")
    objectives = study.levels("emg_objective", [*TRACKING, "minimise"])
    labels = study.levels("cocontraction", LEVELS)
    own = [number(r["force_n"]) for r in study["motions"]]
    return table(["co-contraction", *(f"tracking, EMG noise {o}" if o != "minimise" else o for o in objectives),
                  "the co-contraction's own forces"],
                 [[c, *(study.cell("force_n", cocontraction=c, emg_objective=o) for o in objectives), f]
                  for c, f in zip(labels, own)])


def angles(folder):
    study = Study(folder, "noise")
    objectives = study.levels("emg_objective", [*TRACKING, "minimise"])
    return table(["marker weight", "marker noise", *(f"tracking, EMG noise {o}" if o != "minimise" else o for o in objectives)],
                 [[w, m, *(study.cell("q_deg", weight=w, marker_noise=m, emg_objective=o) for o in objectives)]
                  for w in ("high", "low") for m in study.levels("marker_noise", LEVELS)])


def anova(name):
    def block(folder):
        return table(["source", "df", "F", "p", "partial η²"],
                     [[r["source"], f"{r['df']:.0f}", number(r["F"]) if r["F"] != "" else "",
                       "" if r["p"] == "" else "< 0.001" if r["p"] < 0.001 else f"{r['p']:.3f}",
                       number(r["eta_sq_partial"]) if r["eta_sq_partial"] != "" else ""]
                      for r in Study(folder, "noise")[f"anova-{name}"]])
    return block


def runs(folder):
    rows = []
    for name in ("noise", "window", "muscles", "emg-subset", "emg-level", "limits", "muscles-limits"):
        try:
            s = Study(folder, name)["summary"][0]
        except Missing:
            continue
        rows.append([name, f"{s['trials']:.0f} of {s['planned']:.0f}", f"{s['solves']:.0f}", f"{s['converged_mean']:.2f} %",
                     f"{s['seconds'] / 60:.1f}", f"{s['peak_rss_mb']:.0f}", str(s["processor"]), str(s["version"])])
    return table(["study", "trials", "solves", "converged", "minutes of workers", "most memory of a worker (MB)", "processor",
                  "version"], rows) if rows else ""


def subset(folder):
    study = Study(folder, "emg-subset")
    noise = study.levels("emg_noise", LEVELS)
    return table(["co-contraction", "electrodes", *(f"EMG noise {e}" for e in noise)],
                 [[c, w, *(study.cell("force_n", cocontraction=c, electrodes=w, emg_noise=e) for e in noise)]
                  for c in study.levels("cocontraction", LEVELS) for w in ("all", "subset")])


def emg_level(folder):
    study = Study(folder, "emg-level")
    objectives = study.levels("emg_objective", EMG_LEVELS)
    return table(["marker noise", *(f"tracking, EMG noise {number(o)}" if o != "minimise" else o for o in objectives)],
                 [[m, *(study.cell("q_deg", marker_noise=m, emg_objective=o) for o in objectives)]
                  for m in study.levels("marker_noise", LEVELS)])


def tracking_trials(folder, name):
    """Trials at the high marker weight that track EMG: {(marker noise, EMG noise, co-contraction): {trial: row}}."""
    out = {}
    for r in Study(folder, name)["results"]:
        if r["weight"] == "high" and r["emg_objective"] in TRACKING and r["counted"]:
            out.setdefault((r["marker_noise"], r["emg_objective"], r["cocontraction"]), {})[r["trial"]] = r
    return out


def emg_noise(folder):
    """Force and joint angle errors of the paper's high marker weight and of EMG as a measurement, same seeds."""
    def means(name):
        return {k: [sum(r[e] for r in v.values()) / len(v) for e in ("force_n", "q_deg")]
                for k, v in tracking_trials(folder, name).items()}
    paper, own = means("noise"), means("emg-noise")
    rows = [[m, e, *(f"{number(paper[m, e, c][0])} -> {number(own[m, e, c][0])} ({100 * (own[m, e, c][0] / paper[m, e, c][0] - 1):+.0f} %)"
                     for c in LEVELS),
             f"{number(sum(paper[m, e, c][1] for c in LEVELS) / 4)} -> {number(sum(own[m, e, c][1] for c in LEVELS) / 4)}"]
            for m in LEVELS for e in TRACKING]
    return table(["marker noise", "EMG noise", *(f"force, co-contraction {c} (N)" for c in LEVELS), "joint angles (deg)"], rows)


def emg_noise_verdict(folder):
    """The same in a line each for forces (conditions with EMG noise) and joint angles (all), trial by trial."""
    paper, own = tracking_trials(folder, "noise"), tracking_trials(folder, "emg-noise")
    forces, angles = [], []
    for k in own:
        pairs = [(paper[k][t], own[k][t]) for t in own[k] if t in paper[k]]
        by = [b["q_deg"] - a["q_deg"] for a, b in pairs]
        mean = sum(by) / len(by)
        error = (sum((d - mean) ** 2 for d in by) / max(1, len(by) - 1) / len(by)) ** 0.5
        angles.append((mean, mean / error if error > 0 else 0, k))
        if k[1] != "none":
            forces.append((100 * (sum(b["force_n"] for _, b in pairs) / sum(a["force_n"] for a, _ in pairs) - 1), k))
    forces.sort()
    angles.sort()
    at = "markers {}, EMG {}, co-contraction {}"
    worse = [a for a in angles if a[0] > 0]
    return table(["", "conditions", "from", "to", "how many"],
                 [["force error", str(len(forces)), f"{forces[0][0]:.1f} %", f"{forces[-1][0]:.1f} % ({at.format(*forces[-1][1])})",
                   f"at least 30 % less in {sum(f[0] <= -30 for f in forces)}"],
                  ["joint angle error", str(len(angles)), f"{angles[0][0]:+.4f} deg", f"{angles[-1][0]:+.4f} deg ({at.format(*angles[-1][2])})",
                   f"larger in {len(worse)}, t at most {max((a[1] for a in worse), default=0):.1f}"]])


def limits(folder):
    return table(["formulation", "passive force", "tolerance", "EMG delay (samples)", "q (deg)", "force (N)", "markers (mm)"],
                 [[r["formulation"], r["passive_force"], f"{r['tolerance']:.0e}".replace("e-0", "e-"), number(r["emg_delay"]),
                   *(number(r[e]) for e in ("q_deg", "force_n", "marker_mm"))] for r in Study(folder, "limits").rows()])


def muscles_limits(folder):
    return table(["passive force", "window", "every nth sample", "converged", "q (deg)", "force (N)", "markers (mm)"],
                 [[r["passive_force"], *r["horizon"].split("/"), f"{100 * r['converged']:.1f} %", number(r["q_deg"]),
                   number(r["force_n"]), number(r["marker_mm"])] for r in Study(folder, "muscles-limits").rows()])


# What issue and page hold a draw's held-out errors to.
MISMATCH = {"exact": ("force_n", "N", 6), "noise": ("force_n", "N", 12), "plain": ("force_n", "N", None),
            "insertions": ("force_n", "N", 16), "markers": ("q_deg", "deg", None)}


def mismatch(folder):
    """Held-out errors before and after calibration, draw by draw."""
    found = {}
    for r in Study(folder, "mismatch")["results"]:
        name = "plain" if r["result"] == "plain" else r["errors"]
        if r[MISMATCH[name][0]] != "":
            found.setdefault((name, r["result"] == "before"), {})[int(r["trial"])] = r[MISMATCH[name][0]]
    rows = []
    for name, (what, unit, gate) in MISMATCH.items():
        before, after = found.get((name, True), {}), found.get((name, False), {})
        both = [t for t in after if t in before]
        worse = sum(after[t] >= before[t] for t in both)
        rows.append([f"*{name}*, {'forces' if unit == 'N' else 'joint angles'} ({unit})", f"{len(after)}",
                     f"{number(min(before.values()))} to {number(max(before.values()))}" if before else "",
                     ", ".join(f"{after[t]:.{1 if unit == 'N' else 2}f}" for t in sorted(after)),
                     number(sum(after.values()) / len(after)) if after else "", "" if gate is None else f"{gate}",
                     f"{len(both) - worse} of {len(both)}" if both else ""])
    return table(["held-out motion", "draws", "before", "after, draw by draw", "mean", "at most", "better than before"], rows)


BLOCKS = {
    "verdicts-windows": verdicts("windows"), "verdicts-noise": verdicts("noise"), "rates": rates, "forces": forces,
    "angles": angles, "anova-force": anova("force"), "anova-angles": anova("angles"), "runs": runs, "subset": subset,
    "emg-level": emg_level, "limits": limits, "emg-noise": emg_noise,
    "emg-noise-verdict": emg_noise_verdict,
    "mismatch": mismatch,
    "muscles-limits": muscles_limits,
}


def block(name, folder):
    """Markdown of a block; nothing where its study has no tables."""
    try:
        return BLOCKS[name](folder)
    except Missing:
        return ""
