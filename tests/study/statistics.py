# SPDX-License-Identifier: Apache-2.0
"""The report's statistics against sums of squares by hand, model comparison by least squares, and published figures.

    statistics.py FOLDER_OF_THE_SCRIPTS
"""
import sys

try:
    import numpy as np
    import pandas as pd
    import scipy.stats
    import statsmodels  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)
sys.path.insert(0, sys.argv[1])
import statistics_tables as tables  # noqa: E402

# Tooth growth of guinea pigs: Crampton (1947), J Nutr 33, 491-504, doi:10.1093/jn/33.5.491; R's ToothGrowth.
GROWTH = {
    ("VC", 0.5): [4.2, 11.5, 7.3, 5.8, 6.4, 10.0, 11.2, 11.2, 5.2, 7.0],
    ("VC", 1.0): [16.5, 16.5, 15.2, 17.3, 22.5, 17.3, 13.6, 14.5, 18.8, 15.5],
    ("VC", 2.0): [23.6, 18.5, 33.9, 25.5, 26.4, 32.5, 26.7, 21.5, 23.3, 29.5],
    ("OJ", 0.5): [15.2, 21.5, 17.6, 9.7, 14.5, 10.0, 8.2, 9.4, 16.5, 9.7],
    ("OJ", 1.0): [19.7, 23.3, 23.6, 26.4, 20.0, 25.2, 25.8, 21.2, 14.5, 27.3],
    ("OJ", 2.0): [25.5, 26.4, 22.4, 24.5, 24.8, 30.9, 26.4, 27.3, 29.4, 23.0],
}
FRAME = pd.DataFrame([{"supp": s, "dose": str(d), "half": "first" if i < 5 else "second", "len": v}
                      for (s, d), values in GROWTH.items() for i, v in enumerate(values)])
failed = 0


def check(name, got, wanted, relative=1e-9):
    global failed
    if not np.isclose(got, wanted, rtol=relative, atol=1e-12):
        print(f"FAILED {name}: {got!r}, wanted {wanted!r}")
        failed += 1


def cell(table, source, column):
    return float(table.loc[table["source"] == source, column].iloc[0])


def by_hand(frame, y, factors):
    """Sums of squares and degrees of freedom of a balanced design: the effect of a set of factors is the variation of
    its cell means less that of all its subsets."""
    values = frame[y].to_numpy()
    explained, result = {(): 0.0}, {}
    for mask in range(1, 2**len(factors)):
        chosen = tuple(f for i, f in enumerate(factors) if mask >> i & 1)
        means = frame.groupby(list(chosen))[y].transform("mean").to_numpy()
        subsets = [s for s in explained if s and set(s) < set(chosen)]
        explained[chosen] = np.sum((means - values.mean())**2) - sum(explained[s] for s in subsets)
        result[" x ".join(chosen)] = (explained[chosen], np.prod([frame[f].nunique() - 1 for f in chosen]))
    result["Residual"] = (np.sum((values - values.mean())**2) - sum(v for k, v in explained.items() if k),
                          len(frame) - np.prod([frame[f].nunique() for f in factors]))
    return result


def compare(frame, y, factors):
    table, hand = tables.anova(frame, y, factors), by_hand(frame, y, factors)
    total = sum(v for v, _ in hand.values())
    residual, residual_df = hand["Residual"]
    if set(table["source"]) != set(hand):
        check(f"sources {set(table['source'])}", 0, 1)
        return table
    for source, (squares, df) in hand.items():
        check(f"{source} sum_sq", cell(table, source, "sum_sq"), squares, 1e-8)
        check(f"{source} df", cell(table, source, "df"), df)
        check(f"{source} eta_sq", cell(table, source, "eta_sq"), squares / total, 1e-8)
        if source != "Residual":
            F = squares / df / (residual / residual_df)
            check(f"{source} F", cell(table, source, "F"), F, 1e-7)
            check(f"{source} p", cell(table, source, "p"), scipy.stats.f.sf(F, df, residual_df), 1e-6)
            check(f"{source} partial", cell(table, source, "eta_sq_partial"), squares / (squares + residual), 1e-8)
    return table


def two_way_published():
    table = compare(FRAME, "len", ["supp", "dose"])
    # summary(aov(len ~ supp * factor(dose), ToothGrowth)) of R
    for source, squares, F, p in (("supp", 205.4, 15.572, 0.000231), ("supp x dose", 108.3, 4.107, 0.0218603)):
        check(f"published {source} SS", cell(table, source, "sum_sq"), squares, 5e-4)
        check(f"published {source} F", cell(table, source, "F"), F, 5e-5)
        check(f"published {source} p", cell(table, source, "p"), p, 3e-3)
    check("published dose SS", cell(table, "dose", "sum_sq"), 2426.4, 5e-5)
    check("published dose F", cell(table, "dose", "F"), 92.0, 5e-5)
    check("published residual SS", cell(table, "Residual", "sum_sq"), 712.1, 5e-5)


def three_way():
    compare(FRAME, "len", ["supp", "dose", "half"])


def residual_of(frame, y, terms):
    """Sum of squares that a linear model of these terms leaves, by least squares on plain indicator columns."""
    columns = [np.ones(len(frame))]
    for term in terms:
        labels = frame[list(term)].agg("/".join, axis=1)
        columns += [(labels == v).to_numpy(float) for v in labels.unique()]
    X = np.stack(columns, axis=1)
    left = frame[y].to_numpy() - X @ np.linalg.lstsq(X, frame[y].to_numpy(), rcond=None)[0]
    return left @ left


def unbalanced():
    part = FRAME.drop(index=[0, 1, 2, 17, 31, 32, 44, 59])
    table = tables.anova(part, "len", ["supp", "dose"])
    supp, dose, both = ("supp",), ("dose",), ("supp", "dose")
    check("type II supp", cell(table, "supp", "sum_sq"), residual_of(part, "len", [dose]) - residual_of(part, "len", [supp, dose]), 1e-8)
    check("type II dose", cell(table, "dose", "sum_sq"), residual_of(part, "len", [supp]) - residual_of(part, "len", [supp, dose]), 1e-8)
    check("type II both", cell(table, "supp x dose", "sum_sq"), residual_of(part, "len", [supp, dose]) - residual_of(part, "len", [both]), 1e-8)


def pairwise():
    table = tables.pairs(FRAME, "len", "supp", ["dose"], ["OJ", "VC"], alpha=0.05)
    # t.test(len ~ supp) of R at each dose
    for dose, t, df, p in (("0.5", 3.1697, 14.969, 0.006359), ("1.0", 4.0328, 15.358, 0.001038), ("2.0", -0.046136, 14.04, 0.9639)):
        row = table[table["dose"] == dose].iloc[0]
        check(f"t {dose}", row["t"], t, 1e-4)
        check(f"df {dose}", row["df"], df, 1e-4)
        check(f"p {dose}", row["p"], p, 1e-3)
        check(f"Bonferroni {dose}", row["p_corrected"], min(1, 3 * row["p"]))
        check(f"significant {dose}", row["significant"], dose != "2.0")
        a, b = (np.array(GROWTH[(s, float(dose))]) for s in ("OJ", "VC"))
        spread = np.sqrt((np.sum((a - a.mean())**2) + np.sum((b - b.mean())**2)) / (len(a) + len(b) - 2))
        check(f"d {dose}", row["cohens_d"], (a.mean() - b.mean()) / spread)
    every = tables.pairs(FRAME, "len", "dose", [], ["0.5", "1.0", "2.0"])
    check("pairs of three levels", len(every), 3)


def without_spread():
    """Trials without noise are all the same: no test, and no part in the correction."""
    flat = FRAME.copy()
    flat.loc[flat["dose"] == "0.5", "len"] = 7.0
    table = tables.pairs(flat, "len", "supp", ["dose"], ["OJ", "VC"])
    check("no test", table[table["dose"] == "0.5"]["p"].isna().all(), True)
    row = table[table["dose"] == "1.0"].iloc[0]
    check("correction without it", row["p_corrected"], 2 * row["p"])
    check("not significant", table[table["dose"] == "0.5"]["significant"].any(), False)
    check("an empty cell", tables.anova(FRAME[(FRAME["supp"] == "OJ") | (FRAME["dose"] == "0.5")], "len", ["supp", "dose"]) is None, True)
    check("one level", tables.anova(FRAME[FRAME["supp"] == "OJ"], "len", ["supp"]) is None, True)


two_way_published()
three_way()
unbalanced()
pairwise()
without_spread()
print("statistics: all as it should be" if failed == 0 else f"{failed} failed")
sys.exit(failed > 0)
