# SPDX-License-Identifier: Apache-2.0
"""Analyses of variance, pairwise t-tests and effect sizes of a study's trials.

A trial is a row of a data frame; factors are columns of labels. Trials that are not counted must be left out before.
Sources: Cohen (1988), Statistical Power Analysis, for d and eta squared; Welch (1947, doi:10.1093/biomet/34.1-2.28).
"""
import itertools

import numpy as np
import pandas as pd
from scipy import stats
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm


def anova(frame, response, factors):
    """Analysis of variance with all interactions (type II sums of squares; of balanced data all types agree).

    Columns: source, sum_sq, df, mean_sq, F, p, eta_sq = SS / SS of all rows, eta_sq_partial = SS / (SS + SS_residual).
    Factors with one level alone are left out. None where nothing can be compared.
    """
    data = frame[[response, *factors]].dropna()
    used = [f for f in factors if data[f].nunique() > 1]
    n_cells = int(np.prod([data[f].nunique() for f in used])) if used else 0
    if not used or len(data) <= n_cells or data.groupby(used, observed=True).ngroups < n_cells:
        return None
    # Names of columns may be anything that a formula would take apart.
    plain = data.rename(columns={response: "y_", **{f: f"f{i}_" for i, f in enumerate(used)}})
    for i in range(len(used)):
        plain[f"f{i}_"] = plain[f"f{i}_"].astype(str)
    model = ols("y_ ~ " + " * ".join(f"C(f{i}_, Sum)" for i in range(len(used))), data=plain).fit()
    table = anova_lm(model, typ=2)
    residual = table.loc["Residual", "sum_sq"]
    total = table["sum_sq"].sum()
    rows = []
    for source, row in table.iterrows():
        name = source
        for i, f in enumerate(used):
            name = name.replace(f"C(f{i}_, Sum)", f)
        rows.append({
            "source": name.replace(":", " x "),
            "sum_sq": row["sum_sq"],
            "df": int(row["df"]),
            "mean_sq": row["sum_sq"] / row["df"],
            "F": row["F"],
            "p": row["PR(>F)"],
            "eta_sq": row["sum_sq"] / total if total > 0 else np.nan,
            "eta_sq_partial": row["sum_sq"] / (row["sum_sq"] + residual)
            if source != "Residual" and row["sum_sq"] + residual > 0 else np.nan,
        })
    return pd.DataFrame(rows)


def cohens_d(a, b):
    """Difference of the means in pooled standard deviations."""
    n, m = len(a), len(b)
    pooled = ((n - 1) * np.var(a, ddof=1) + (m - 1) * np.var(b, ddof=1)) / (n + m - 2)
    return (np.mean(a) - np.mean(b)) / np.sqrt(pooled) if pooled > 0 else np.nan


def has_spread(values):
    """False for trials without noise, which are all the same but for rounding."""
    return np.std(values) > 1e-9 * np.max(np.abs(values))


def pairs(frame, response, of, within, levels=None, alpha=0.001):
    """Welch's t-test of every two levels of `of` in every cell of `within`, p corrected by Bonferroni.

    Columns: those of `within`, a, b, n_a, n_b, mean_a, mean_b, t, df, p, p_corrected (p times the number of tests of
    the table, 1 at most), cohens_d, significant (p_corrected < alpha). Where neither side varies there is no test.
    """
    order = [str(v) for v in (levels or sorted(frame[of].astype(str).unique()))]
    rows = []
    for key, part in cells(frame, within):
        for a, b in itertools.combinations(order, 2):
            x = part.loc[part[of].astype(str) == a, response].dropna().to_numpy()
            y = part.loc[part[of].astype(str) == b, response].dropna().to_numpy()
            if len(x) < 2 or len(y) < 2:
                continue
            row = dict(zip(within, key), a=a, b=b, n_a=len(x), n_b=len(y), mean_a=x.mean(), mean_b=y.mean(),
                       t=np.nan, df=np.nan, p=np.nan, cohens_d=np.nan)
            if has_spread(x) or has_spread(y):
                t, p = stats.ttest_ind_from_stats(x.mean(), np.std(x, ddof=1), len(x), y.mean(), np.std(y, ddof=1), len(y),
                                                  equal_var=False)
                u, v = np.var(x, ddof=1) / len(x), np.var(y, ddof=1) / len(y)
                row.update(t=t, p=p, df=(u + v)**2 / (u**2 / (len(x) - 1) + v**2 / (len(y) - 1)),
                           cohens_d=cohens_d(x, y))
            rows.append(row)
    table = pd.DataFrame(rows)
    if table.empty:
        return None
    tests = int(table["p"].notna().sum())
    table["p_corrected"] = np.minimum(1, table["p"] * tests)
    table["significant"] = table["p_corrected"] < alpha
    return table


def cells(frame, factors):
    """Every combination of labels that is there, in the order of the rows: (labels as a tuple, rows)."""
    if not factors:
        return [((), frame)]
    groups = frame.groupby(factors[0] if len(factors) == 1 else list(factors), observed=True, sort=False)
    return [(key if isinstance(key, tuple) else (key,), part) for key, part in groups]


ERRORS = ["q_deg", "qdot_rad_s", "activation", "excitation", "force_n", "marker_mm"]


def conditions(frame, factors):
    """Per condition: trials, counted ones, convergence and rate of all, and mean and spread of the errors of the counted."""
    rows = []
    for key, part in cells(frame, factors):
        counted = part[part["counted"] == 1]
        row = dict(zip(factors, key), trials=len(part), counted=len(counted), failed=int((part["status"] == "failed").sum()),
                   converged=part["converged"].mean())
        for name in ERRORS:
            row[name] = counted[name].mean()
            row[name + "_sd"] = counted[name].std(ddof=1)
        row.update(rate_hz=part["rate_hz"].mean(), rate_hz_sd=part["rate_hz"].std(ddof=1))
        rows.append(row)
    return pd.DataFrame(rows)
