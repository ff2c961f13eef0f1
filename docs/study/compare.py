# SPDX-License-Identifier: Apache-2.0
"""What Bailly et al. (2021, doi:10.3389/fbioe.2021.642742) say, beside what the tables of mhe-study report hold.

Every statement of the paper is a function that returns (what the paper says, what our tables say, verdict); the verdict
follows from the numbers by a rule that stands here.
"""
import csv
import json
import os

REPRODUCED, BETTER, MOSTLY, NOT = "reproduced", "better", "mostly", "not reproduced"
TRACKING = ["none", "low", "mid", "high"]
LEVELS = ["none", "low", "mid", "high"]
EMG_LEVELS = [0, 0.1, 0.25, 0.5, 1, "minimise"]  # of the study emg-level


class WrongTable(Exception):
    """A table lacks what the page is to show."""


class Missing(Exception):
    """A study whose tables are not there."""


def study_name(text):
    return json.loads(text)["name"].removeprefix("study-").removesuffix("-quick")


def value(text):
    try:
        return float(text)
    except ValueError:
        return {"True": True, "False": False}.get(text, text)


class Study:
    """The tables of one study, as lists of rows: study.conditions, study["pairs-force"]."""

    def __init__(self, folder, name):
        self.folder, self.name, self.read = os.path.join(folder, name), name, {}
        if not os.path.isdir(self.folder):
            raise Missing(name)

    def __getitem__(self, table):
        if table not in self.read:
            path = os.path.join(self.folder, table + ".csv")
            if not os.path.exists(path):
                raise WrongTable(f"{path} is missing")
            with open(path, encoding="utf-8", newline="") as file:
                self.read[table] = [{k: v if k in ("horizon", "a", "b") else value(v) for k, v in row.items()}
                                    for row in csv.DictReader(file)]
        return self.read[table]

    def rows(self, table="conditions", **where):
        """Rows whose cells are these, or among these."""
        chosen = [r for r in self[table]
                  if all(r[k] in (v if isinstance(v, (list, tuple)) else [v]) for k, v in where.items())]
        if not chosen:
            raise WrongTable(f"{self.folder}/{table}.csv holds no row with {where}")
        return chosen

    def mean(self, column, **where):
        """Mean over the conditions, each with as many trials as were counted."""
        known = [r for r in self.rows(**where) if r[column] != ""]
        if not known:
            raise WrongTable(f"{self.folder}/conditions.csv: no '{column}' where {where}")
        return sum(r[column] * r["counted"] for r in known) / sum(r["counted"] for r in known)

    def cell(self, column, **where):
        """As mean(), for a table: empty where there is none."""
        try:
            return number(self.mean(column, **where))
        except WrongTable:
            return ""

    def levels(self, factor, among):
        """Those of the labels that the study has."""
        there = {r[factor] for r in self["conditions"]}
        return [label for label in among if label in there]


def number(x):
    digits = f"{x:.3g}"
    return digits if "e" not in digits else f"{x:.0f}" if abs(x) >= 1 else digits


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
                     + ["| " + " | ".join(r) + " |" for r in rows]) + "\n"


def judge(ours, paper, more_is_better=False, margin=1.1):
    """Better: by more than a tenth; reproduced: within it."""
    gain = ours / paper if more_is_better else paper / ours
    return BETTER if gain > margin else REPRODUCED if gain >= 1 / margin else NOT


def holds(condition):
    return REPRODUCED if condition else NOT


def holds_in(n, of):
    """Mostly: in three of four comparisons or more."""
    return REPRODUCED if n == of else MOSTLY if 4 * n >= 3 * of else NOT


# ---- statements: windows and rates ----

def window_seven(formulation, folder, **also):
    rows = [r for r in Study(folder, "window").rows(formulation=formulation, ratios="authors", **also)
            if r["horizon"].split("/")[0] == "7"]
    if not rows:
        raise WrongTable(f"window/conditions.csv: no window of 7 intervals, {formulation}-driven")
    return rows[0]


def rate(folder):
    row = window_seven("excitation", folder)
    return "about 24 Hz", f"{row['rate_hz']:.0f} ± {row['rate_hz_sd'] or 0:.0f} Hz", judge(row["rate_hz"], 24, True)


def rate_activation(folder):
    """With every sample, where the intervals of both are as long."""
    study = Study(folder, "window")
    by = {f: {r["horizon"]: r["rate_hz"] for r in study.rows(formulation=f, ratios="every")}
          for f in ("excitation", "activation")}
    common = [n for n in by["activation"] if n in by["excitation"]]
    gains = [by["activation"][n] / by["excitation"][n] for n in common]
    return ("activation-driven about 10 Hz faster for the same window",
            f"faster at {sum(g > 1 for g in gains)} of {len(common)} windows with every sample, "
            f"{sum(gains) / len(gains):.2f} times on average", holds_in(sum(g > 1 for g in gains), len(common)))


def rate_standard(folder):
    """The paper's longest windows fall under 13.3 Hz; what counts here is the slowest of ours."""
    rows = Study(folder, "window").rows(ratios="authors")
    slowest = min(rows, key=lambda r: r["rate_hz"])
    return ("up to 30 Hz; only short windows above the biofeedback standard of 13.3 Hz",
            f"slowest window: {slowest['rate_hz']:.0f} Hz ({slowest['formulation']}-driven, {slowest['horizon'].split('/')[0]} "
            f"intervals); fastest: {max(r['rate_hz'] for r in rows):.0f} Hz",
            BETTER if slowest["rate_hz"] > 30 else holds(slowest["rate_hz"] > 13.3))


def errors_at_seven(folder):
    row = window_seven("excitation", folder)
    within = row["q_deg"] < 0.01 and row["marker_mm"] < 0.01
    verdict = judge(row["force_n"], 1) if within else NOT
    return ("joint angles < 0.01 (deg), muscle forces 1 N, markers < 0.01 mm",
            f"{number(row['q_deg'])} deg, {number(row['force_n'])} N, {number(row['marker_mm'])} mm (one frame in three)", verdict)


def errors_every_sample(folder):
    row = Study(folder, "window").rows(formulation="excitation", ratios="every", horizon="7/1")[0]
    return ("(no such run: too slow for every sample)",
            f"{number(row['q_deg'])} deg, {number(row['force_n'])} N, {number(row['marker_mm'])} mm at {row['rate_hz']:.0f} Hz",
            judge(row["force_n"], 1))


def whole(solver):
    def whole_recording(folder):
        rows = Study(folder, "window").rows(ratios="whole", solver=solver)
        parts = []
        for r in rows:
            length = int(r["horizon"].split("/")[0]) * 0.01
            times = 1 / r["rate_hz"] / length
            parts.append((times, f"{r['formulation']}-driven {1 / r['rate_hz']:.2f} s for {length:.2f} s of motion "
                                 f"({number(times)} × real time), converged {100 * r['converged']:.0f} %"))
        converged = all(r["converged"] == 1 for r in rows)
        return ("whole recording as one window: 3.7 × real time", f"`mhe.solver.{solver.split('-')[0]}`: " + "; ".join(p[1] for p in parts),
                judge(max(p[0] for p in parts), 3.7) if converged else NOT)
    return whole_recording


def muscles(folder):
    rows = {f: Study(folder, "muscles").rows(formulation=f, horizon=h)[0]
            for f, h in (("excitation", "7/3"), ("activation", "7/4"))}
    verdicts = [judge(rows["excitation"]["rate_hz"], 10, True), judge(rows["activation"]["rate_hz"], 21, True)]
    return ("35 muscles: 10 Hz excitation-driven, 21 Hz activation-driven",
            f"{rows['excitation']['rate_hz']:.0f} Hz and {rows['activation']['rate_hz']:.0f} Hz",
            NOT if NOT in verdicts else BETTER if set(verdicts) == {BETTER} else REPRODUCED)


# ---- statements: noise ----

def convergence(folder):
    s = Study(folder, "noise")["summary"][0]
    return ("98.95 % of the solves converge, 80 to 100 % by condition",
            f"{s['converged_mean']:.2f} %, {s['converged_min']:.1f} to {s['converged_max']:.1f} % by condition; "
            f"{s['below']:.0f} of {s['trials']:.0f} trials under 90 %, {s['failed']:.0f} failed",
            holds(s["converged_mean"] >= 98.95 and s["converged_min"] >= 80))


def force_range(folder):
    parts, worst = [], 0
    for name, objectives in (("tracking", TRACKING), ("minimising", ["minimise"])):
        values = [r["force_n"] for r in Study(folder, "noise").rows(emg_objective=objectives) if r["force_n"] != ""]
        parts.append(f"{name} {number(min(values))} to {number(max(values))} N")
        worst = max(worst, *values)
    return "force errors of 1 to 30 N", " and ".join(parts) + " by condition", holds(worst <= 30)


def against_minimise(row):
    """Mean of tracking and of minimising, where the row compares the two."""
    if "minimise" not in (row["a"], row["b"]):
        return None
    return (row["mean_b"], row["mean_a"]) if row["a"] == "minimise" else (row["mean_a"], row["mean_b"])


def compare_minimise(folder, pairs, where):
    """(tests, those in which tracking is better, those with significance, those in which minimising is better with it)"""
    rows = [r for r in Study(folder, "noise").rows(pairs, **where) if against_minimise(r)]
    better = [r for r in rows if against_minimise(r)[0] < against_minimise(r)[1]]
    sure = [r for r in better if r["significant"] is True]
    worse = [r for r in rows if r not in better and r["significant"] is True]
    return len(rows), len(better), len(sure), len(worse)


def minimise_worse(folder):
    n, better, sure, worse = compare_minimise(folder, "pairs-force", {"cocontraction": ["low", "mid", "high"]})
    return ("least excitation estimates forces worse than tracking at low, mid and high co-contraction",
            f"tracking better in {better} of {n} comparisons, {sure} of them significant; the other way round {worse}",
            holds_in(sure, n))


def minimise_grows(folder):
    study = Study(folder, "noise")
    means = [study.mean("force_n", emg_objective="minimise", cocontraction=c) for c in LEVELS]
    return ("least excitation: force error grows with co-contraction", " / ".join(number(m) for m in means) + " N",
            holds(sorted(means) == means))


def insensitive(folder):
    rows = Study(folder, "noise").rows("pairs-force-cocontraction", emg_objective=TRACKING)
    sure = [r for r in rows if r["significant"] is True]
    each = Study(folder, "noise").rows("pairs-force-cocontraction-each", emg_objective=TRACKING)
    apart = max(abs(r["mean_a"] - r["mean_b"]) for r in rows)
    return ("tracking: force error insensitive to co-contraction, but for two tests",
            f"{len(sure)} of {len(rows)} comparisons significant, the means at most {number(apart)} N apart; "
            f"{sum(r['significant'] is True for r in each)} of {len(each)} in groups of {max(r['n_a'] for r in each):.0f} trials",
            holds(len(sure) <= 2))


def emg_noise(folder):
    study = Study(folder, "noise")
    means = [study.mean("force_n", emg_objective=level) for level in TRACKING]
    return ("force error grows with EMG noise", " / ".join(number(m) for m in means) + " N",
            holds(sorted(means) == means))


def marker_noise(folder):
    study = Study(folder, "noise")
    means = [study.mean("q_deg", marker_noise=level) for level in LEVELS]
    cells = study.rows("pairs-angles-noise")
    growing = [r for r in cells if r["mean_a"] < r["mean_b"]]
    return ("joint angle error grows with marker noise",
            " / ".join(number(m) for m in means) + f" deg; in {len(growing)} of {len(cells)} comparisons",
            holds_in(len(growing), len(cells)) if sorted(means) == means else NOT)


def emg_irrelevant(folder):
    rows = [r for r in Study(folder, "noise").rows("pairs-angles", weight="high") if not against_minimise(r)]
    noisy = [r for r in rows if r["marker_noise"] != "none"]
    sure = [r for r in noisy if r["significant"] is True]
    return ("high marker weight: EMG noise does not matter for joint angles",
            f"{len(sure)} of {len(noisy)} comparisons significant with marker noise, "
            f"{len([r for r in rows if r not in noisy and r['significant'] is True])} of {len(rows) - len(noisy)} without",
            holds(not sure))


def low_weight(folder):
    n, better, sure, worse = compare_minimise(folder, "pairs-angles",
                                              {"weight": "low", "marker_noise": ["none", "low", "mid"]})
    return ("low marker weight: tracking estimates joint angles better than minimising at no, low and mid marker noise",
            f"better in {better} of {n} comparisons, {sure} of them significant; the other way round {worse}",
            holds_in(sure, n))


def excitation_minimise(folder):
    study = Study(folder, "noise")
    means = [study.mean("excitation", emg_objective="minimise", cocontraction=c) for c in LEVELS]
    paper = [0.013, 0.041, 0.079, 0.091]
    return ("excitation error, minimising: 0.013 / 0.041 / 0.079 / 0.091 for no / low / mid / high co-contraction",
            " / ".join(number(m) for m in means),
            BETTER if all(m <= p for m, p in zip(means, paper)) else holds(all(abs(m - p) <= 0.1 * p for m, p in zip(means, paper))))


def excitation_track(folder):
    rows = Study(folder, "noise").rows(emg_objective="none")
    values = [r["excitation"] for r in rows if r["excitation"] != ""]
    return ("excitation error, tracking without EMG noise: 0.003 to 0.007", f"{number(min(values))} to {number(max(values))}",
            holds(round(max(values), 3) <= 0.007))


STATEMENTS = {
    "windows": [rate, rate_activation, rate_standard, errors_at_seven, errors_every_sample, muscles, whole("rti-whole"),
                whole("ipopt-whole")],
    "noise": [convergence, force_range, minimise_worse, minimise_grows, insensitive, emg_noise, marker_noise, emg_irrelevant,
              low_weight, excitation_minimise, excitation_track],
}
