# SPDX-License-Identifier: Apache-2.0
"""Tables, statistics, figures and one page of a study's results.

    /usr/bin/python3 report.py DIR

DIR holds study.json, results.csv and timing.csv as mhe-study writes them; what is made goes to DIR/report. The study
file's section `report` says which tables and figures: noise_example, rate, windows, forces, boxes, anova, pairs.
"""
import json
import os
import sys

import matplotlib
import numpy as np
import pandas as pd
import scipy
import statsmodels

import figures
import page
import statistics_tables as tables


class WrongReport(Exception):
    """The report section asks for what the study does not have."""


class Report:

    def __init__(self, folder):
        self.folder = folder
        self.out = os.path.join(folder, "report")
        os.makedirs(self.out, exist_ok=True)
        with open(os.path.join(folder, "study.json"), encoding="utf-8") as file:
            self.study = json.load(file)
        self.asked = self.study["report"]
        self.levels = {f["name"]: f["levels"] for f in self.study["factors"]}
        self.factors = list(self.levels)
        labels = {name: str for name in self.factors}
        keep = {"keep_default_na": False, "na_values": [""], "dtype": labels}
        self.trials = pd.read_csv(os.path.join(folder, "results.csv"), **keep)
        timing = pd.read_csv(os.path.join(folder, "timing.csv"), **keep)
        self.trials = self.trials.merge(timing, on=self.factors + ["trial"], validate="one_to_one")
        self.counted = self.trials[self.trials["counted"] == 1]
        self.page = page.Page(f"Study {self.study['name']}")
        self.pair_tables = {}

    # ---- what the section may name ----

    def column(self, name, where):
        if name not in self.trials.columns:
            raise WrongReport(f"report: {where}: the results have no column '{name}' (they have {', '.join(self.trials.columns)})")
        return name

    def factor(self, name, where):
        if name not in self.levels:
            raise WrongReport(f"report: {where}: the study has no factor '{name}' (it has {', '.join(self.factors)})")
        return name

    def select(self, frame, where, what):
        for name, wanted in (where or {}).items():
            self.column(name, what)
            wanted = [str(v) for v in (wanted if isinstance(wanted, list) else [wanted])]
            frame = frame[frame[name].astype(str).isin(wanted)]
        return frame

    def order(self, name, frame):
        """Labels of a factor, or values of a column, that are there, in their order."""
        there = set(frame[name].astype(str))
        return [v for v in self.levels.get(name, sorted(there)) if v in there]

    # ---- parts ----

    def save_table(self, name, table, heading, text=""):
        table.to_csv(os.path.join(self.out, f"{name}.csv"), index=False, float_format="%.8g")
        with open(os.path.join(self.out, f"{name}.md"), "w", encoding="utf-8") as file:
            file.write(page.markdown(table))
        self.page.heading(heading)
        if text:
            self.page.text(text)
        self.page.table(table)

    def save_figure(self, name, figure, caption):
        path = os.path.join(self.out, name)
        figures.save(figure, path)
        self.page.heading(name.capitalize())
        self.page.figure(path + ".png", caption)

    def overview(self):
        s, t = self.study, self.trials
        failed = int((t["status"] == "failed").sum())
        below = len(t) - failed - len(self.counted)
        table = tables.conditions(t, self.factors)
        percent = 100 * table["converged"]
        lines = [f"{len(t)} of {s['n_trials']} trials, {int(t['solves'].sum())} solves; {failed} trials failed, {below} under "
                 f"{100 * s['exclude_below']:g} % converged: kept, and left out of statistics.",
                 f"Converged: {percent.mean():.2f} % on average, {percent.min():.1f} to {percent.max():.1f} % by condition.",
                 f"{t['seconds'].sum():.0f} s of computing on {s['processor'] or 'an unknown processor'}; most memory of a worker "
                 f"{t['peak_rss_mb'].max():.0f} MB."]
        for line in lines:
            self.page.text(line)
            print(line)
        self.save_table("conditions", table, "Conditions")
        summary = {
            "trials": len(t), "planned": s["n_trials"], "failed": failed, "below": below, "solves": int(t["solves"].sum()),
            "converged_mean": percent.mean(), "converged_min": percent.min(), "converged_max": percent.max(),
            "seconds": t["seconds"].sum(), "peak_rss_mb": t["peak_rss_mb"].max(),
            "processor": s["processor"], "version": s["version"], "seed": s["seed"],
        }
        pd.DataFrame([summary]).to_csv(os.path.join(self.out, "summary.csv"), index=False, float_format="%.6g")

    def noise_example(self, asked):
        path = os.path.join(self.out, "noise_example.csv")
        if os.path.exists(path):
            levels = [float(v) for v in asked.get("levels", [1, 1.5, 2])]
            self.save_figure(asked.get("name", "noise"), figures.noise_example(pd.read_csv(path), levels),
                             "EMG noise: excitations of the reference motion without and with noise.")

    def rate(self, asked):
        by = self.column(asked.get("by", "formulation"), "rate")
        part = self.select(self.trials, asked.get("where"), "rate")
        if part["rate_hz"].notna().any():
            figure = figures.rate(part, by, self.order(by, part), asked.get("standard_hz"))
            self.save_figure(asked.get("name", "rate"), figure, "Rate over the window: mean and standard deviation of repeated runs, without the first solve of each.")
            table = part.groupby([by, "window", "ratio"], sort=False)["rate_hz"].agg(["count", "mean", "std"]).reset_index()
            self.save_table("rate", table, "Rates (Hz)")

    def windows(self, asked):
        by = self.column(asked.get("by", "formulation"), "windows")
        part = self.select(self.counted, asked.get("where"), "windows")
        whole = self.select(self.counted, asked["whole"], "windows") if asked.get("whole") else self.counted.iloc[:0]
        self.save_figure(asked.get("name", "windows"), figures.windows(part, whole, by, self.order(by, part)),
                         "Errors over the window (log scale), and of one window of the whole recording.")

    def read_sto(self, path):
        with open(path, encoding="utf-8") as file:
            head = next(i for i, line in enumerate(file) if line.strip() == "endheader")
        return pd.read_csv(path, sep="\t", skiprows=head + 1)

    def forces(self, asked):
        by = self.factor(asked.get("by", self.factors[0]), "forces")
        groups, reference = {}, None
        for number, condition in enumerate(self.study["conditions"]):
            files = [os.path.join(self.folder, "forces", f"{number:04d}-{k:04d}.sto") for k in range(condition["trials"])]
            runs = [self.read_sto(f) for f in files if os.path.exists(f)] if condition["forces"] else []
            if not runs:
                continue
            first, n = int(asked.get("skip_first", 0)), min(len(r) for r in runs)
            runs = [r.iloc[first:n] for r in runs]
            stack = np.stack([r.iloc[:, 1:].to_numpy() for r in runs])
            names = runs[0].columns[1:]
            label = condition["labels"][by]
            label = asked.get("labels", {}).get(label, label)
            sd = stack.std(axis=0, ddof=1) if len(runs) > 1 else np.zeros(stack.shape[1:])
            groups[label] = (runs[0]["time"], pd.DataFrame(stack.mean(axis=0), columns=names), pd.DataFrame(sd, columns=names))
            reference = self.read_sto(condition["motion"]) if os.path.exists(condition["motion"]) else reference
        if groups:
            time = next(iter(groups.values()))[0]
            reference = reference[reference["time"].between(time.min(), time.max())] if reference is not None else pd.DataFrame()
            self.save_figure(asked.get("name", "forces"), figures.forces(reference, groups),
                             "Muscle forces: reference, and mean and standard deviation of the trials.")

    def motions(self):
        """How far the true excitations and forces of the motions are from those of the first one."""
        files = dict.fromkeys((c["reference"], c["motion"]) for c in self.study["conditions"])
        motions = [(name, self.read_sto(path)) for name, path in files if os.path.exists(path)]
        if len(motions) < 2 or len({len(m) for _, m in motions}) > 1:
            return
        rows = []
        for name, motion in motions:
            row = {"motion": name}
            for column, prefix in (("excitation", "e_"), ("force_n", "F_")):
                names = [c for c in motion.columns if c.startswith(prefix)]
                row[column] = np.sqrt(((motion[names] - motions[0][1][names]) ** 2).mean()).mean() if names else np.nan
            rows.append(row)
        self.save_table("motions", pd.DataFrame(rows), "Motions",
                        f"RMS difference of the true excitations and forces from those of {motions[0][0]}, mean over the muscles.")

    def anova(self, asked):
        y, name = self.column(asked["y"], "anova"), asked.get("name", asked["y"])
        factors = [self.column(f, "anova") for f in asked["factors"]]
        table = tables.anova(self.select(self.counted, asked.get("where"), "anova"), y, factors)
        heading = f"ANOVA of {figures.title(y)}: {' x '.join(figures.words(f) for f in factors)}"
        if table is None:
            self.page.heading(heading)
            self.page.text("Too few trials in some combination of levels.")
        else:
            self.save_table(f"anova-{name}", table, heading, "Type II sums of squares, all interactions.")

    def pairs(self, asked):
        y, of = self.column(asked["y"], "pairs"), self.column(asked["of"], "pairs")
        within = [self.column(f, "pairs") for f in asked.get("within", [])]
        part = self.select(self.counted, asked.get("where"), "pairs")
        alpha = float(self.asked.get("alpha", 0.001))
        table = tables.pairs(part, y, of, within, self.order(of, part), alpha)
        if table is not None:
            tests = int(table["p"].notna().sum())
            self.save_table(f"pairs-{asked.get('name', y)}", table, f"Pairs of {figures.words(of)}: {figures.title(y)}",
                            f"Welch's t-tests, p times {tests} (Bonferroni), significant below {alpha:g}; d is Cohen's.")

    def boxes(self, asked):
        y = self.column(asked["y"], "boxes")
        x, by = self.column(asked["x"], "boxes"), self.column(asked["by"], "boxes")
        part = self.select(self.counted, asked.get("where"), "boxes")
        if part.empty:
            return
        by_levels, stars, against = self.order(by, part), set(), asked.get("against")
        caption = f"{figures.title(y).capitalize()} by {figures.words(x)} and {figures.words(by)}; boxes are quartiles."
        if against in by_levels:
            table = tables.pairs(part, y, by, [x], by_levels, float(self.asked.get("alpha", 0.001)))
            for row in table.itertuples() if table is not None else []:
                if row.significant and against in (row.a, row.b):
                    stars.add((getattr(row, x), row.b if row.a == against else row.a))
            caption += (f" *: different from '{against}' at the same {figures.words(x)} (Welch's t-test, Bonferroni, p < "
                        f"{float(self.asked.get('alpha', 0.001)):g}).")
        self.save_figure(asked.get("name", y), figures.boxes(part, y, x, by, self.order(x, part), by_levels, stars), caption)

    def end(self):
        self.page.heading("How it was made")
        self.page.text(f"Myohorizon {self.study['version']}, seed {self.study['seed']}; statistics by statsmodels "
                       f"{statsmodels.__version__}, scipy {scipy.__version__}, pandas {pd.__version__}; figures by matplotlib "
                       f"{matplotlib.__version__}.")
        for name, what in (("study.yaml", "The study"), ("config.yaml", "The estimator of its first condition")):
            with open(os.path.join(self.folder, name), encoding="utf-8") as file:
                self.page.text(what + ":")
                self.page.code(file.read())
        self.page.write(os.path.join(self.out, "report.html"))

    def make(self):
        self.overview()
        known = ["noise_example", "rate", "windows", "forces", "boxes", "anova", "pairs"]
        for name in self.asked:
            if name not in known + ["alpha"]:
                raise WrongReport(f"report: unknown part '{name}' (valid: {', '.join(known + ['alpha'])})")
        for name in known:
            asked = self.asked.get(name)
            for part in asked if isinstance(asked, list) else [asked] if asked else []:
                try:
                    getattr(self, name)(part)
                except KeyError as missing:
                    raise WrongReport(f"report: {name}: the key {missing} is needed") from None
        self.motions()
        self.end()


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        Report(sys.argv[1]).make()
    except (WrongReport, OSError) as why:
        print(f"mhe-study: {why}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
