# SPDX-License-Identifier: Apache-2.0
"""Figures of a study at the size and in the grouping of Bailly et al. (2021), doi:10.3389/fbioe.2021.642742."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

WIDTH = 7.1  # inches: two columns of a journal page
COLOURS = ["#1b6ca8", "#5fa8d3", "#8fb996", "#e9a23b", "#d1495b", "#6d597a", "#2f4858", "#b08968"]
TITLES = {
    "q_deg": "joint angles, RMSE (deg)",
    "qdot_rad_s": "joint velocities, RMSE (rad/s)",
    "activation": "activations, RMSE",
    "excitation": "excitations, RMSE",
    "force_n": "muscle forces, RMSE (N)",
    "marker_mm": "markers, RMSE (mm)",
    "rate_hz": "rate (Hz)",
}

plt.rcParams.update({
    "font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6,
    "lines.linewidth": 1.0, "legend.frameon": False, "legend.fontsize": 7, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "pdf.fonttype": 42, "figure.constrained_layout.use": True, "svg.hashsalt": "mhe",
})


def words(label):
    return str(label).replace("_", " ")


def title(name):
    return TITLES.get(name, words(name))


def save(figure, path):
    """path.pdf and path.png, the same bytes for the same data."""
    figure.savefig(f"{path}.pdf", metadata={"CreationDate": None})
    figure.savefig(f"{path}.png", dpi=200, metadata={"Software": None})
    plt.close(figure)


def noise_example(data, levels):
    """`data`: time, and per muscle columns <muscle>/0 (true) and <muscle>/<level>. One row a muscle, one column a level."""
    muscles = list(dict.fromkeys(c.rsplit("/", 1)[0] for c in data.columns if c != "time"))
    figure, axes = plt.subplots(len(muscles), len(levels), figsize=(WIDTH, 1.5 * len(muscles) + 0.5), sharex=True,
                                sharey="row", squeeze=False)
    for row, muscle in enumerate(muscles):
        for column, level in enumerate(levels):
            axis = axes[row][column]
            axis.plot(data["time"], data[f"{muscle}/0"], color="black", label="reference")
            axis.plot(data["time"], data[f"{muscle}/{level:g}"], color=COLOURS[4], alpha=0.85, label="with noise")
            if row == 0:
                axis.set_title(f"noise level {level:g}")
            if row == len(muscles) - 1:
                axis.set_xlabel("time (s)")
        axes[row][0].set_ylabel(f"{muscle}\nexcitation")
    axes[0][-1].legend(loc="upper right")
    return figure


def rate(trials, by, levels, standard_hz):
    """Mean and spread of the rate over the window, per level of `by`, with the rate that biofeedback needs."""
    figure, axis = plt.subplots(figsize=(WIDTH * 0.6, 2.8))
    for i, level in enumerate(levels):
        part = trials[trials[by] == level].groupby("window")["rate_hz"]
        mean, sd = part.mean(), part.std(ddof=1).fillna(0)
        axis.errorbar(mean.index, mean, yerr=sd, color=COLOURS[4 * (i % 2)], marker="o", markersize=3, capsize=2,
                      label=f"{words(level)}-driven" if by == "formulation" else words(level))
    if standard_hz:
        axis.axhline(standard_hz, color="black", linestyle="--", linewidth=0.8, label=f"biofeedback standard ({standard_hz:g} Hz)")
    axis.xaxis.get_major_locator().set_params(integer=True)
    axis.set_xlabel("window N (intervals)")
    axis.set_ylabel("rate (Hz)")
    axis.set_ylim(bottom=0)
    axis.legend()
    return figure


def windows(trials, whole, by, levels):
    """Errors over the window, one logarithmic panel each; `whole`: trials whose window is the whole recording."""
    names = ["q_deg", "force_n", "marker_mm"]
    figure, axes = plt.subplots(1, len(names), figsize=(WIDTH, 2.8))
    for axis, name in zip(axes, names):
        for i, level in enumerate(levels):
            colour = COLOURS[4 * (i % 2)]
            mean = trials[trials[by] == level].groupby("window")[name].mean()
            axis.plot(mean.index, mean, color=colour, marker="o", markersize=3, label=f"{words(level)}, window")
            full = whole[whole[by] == level][name].mean()
            if np.isfinite(full):
                axis.axhline(full, color=colour, linestyle="--", linewidth=0.8, label=f"{words(level)}, whole recording")
        axis.set_yscale("log")
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.set_xlabel("window N (intervals)")
        axis.set_title(title(name))
    figure.get_layout_engine().set(rect=(0, 0, 1, 0.91))
    figure.legend(*axes[0].get_legend_handles_labels(), ncol=4, loc="upper center")
    return figure


def forces(reference, groups):
    """Muscle forces over time: `reference` a frame; `groups` {label: (time, mean, sd)} with columns by muscle."""
    muscles = list(next(iter(groups.values()))[1].columns)
    columns = 4
    rows = -(-len(muscles) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDTH, 1.15 * rows + 0.4), squeeze=False)
    for axis in axes.flat[len(muscles):]:
        axis.set_visible(False)
    for axis, muscle in zip(axes.flat, muscles):
        for i, (label, (time, mean, sd)) in enumerate(groups.items()):
            colour = COLOURS[4 * (i % 2)]
            axis.fill_between(time, mean[muscle] - sd[muscle], mean[muscle] + sd[muscle], color=colour, alpha=0.25, linewidth=0)
            axis.plot(time, mean[muscle], color=colour, label=words(label))
        if f"F_{muscle}" in reference:
            axis.plot(reference["time"], reference[f"F_{muscle}"], color="black", linewidth=0.8, label="reference")
        axis.set_title(muscle, fontsize=7, pad=2)
        axis.tick_params(labelsize=6)
    for axis in axes[:, 0]:
        axis.set_ylabel("force (N)", fontsize=7)
    for i in range(max(0, len(muscles) - columns), len(muscles)):
        axes.flat[i].set_xlabel("time (s)", fontsize=7)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    if axes.size > len(muscles):  # the place that is left
        axes.flat[-1].set_visible(True)
        axes.flat[-1].axis("off")
        axes.flat[-1].legend(handles, labels, loc="center")
    else:
        axes.flat[0].legend(handles, labels)
    return figure


def boxes(trials, y, x, by, x_levels, by_levels, stars):
    """Box plots of `y`, grouped by `x`, one colour a level of `by`; (x level, by level) in `stars` get an asterisk."""
    figure, axis = plt.subplots(figsize=(WIDTH, 2.9))
    width = 0.8 / len(by_levels)
    for i, label in enumerate(by_levels):
        colour = COLOURS[i % len(COLOURS)]
        for k, place in enumerate(x_levels):
            values = trials.loc[(trials[x] == place) & (trials[by] == label), y].dropna()
            if values.empty:
                continue
            at = k + (i - (len(by_levels) - 1) / 2) * width
            drawn = axis.boxplot(values, positions=[at], widths=width * 0.8, patch_artist=True, manage_ticks=False,
                                 flierprops={"marker": ".", "markersize": 2, "markeredgecolor": colour},
                                 medianprops={"color": "black"}, whiskerprops={"linewidth": 0.6},
                                 capprops={"linewidth": 0.6}, boxprops={"linewidth": 0.6})
            drawn["boxes"][0].set_facecolor(colour)
            if (place, label) in stars:
                axis.annotate("*", (at, values.max()), ha="center", va="bottom", fontsize=9)
        axis.plot([], [], color=colour, linewidth=5, label=words(label))
    axis.set_xticks(range(len(x_levels)), [words(v) for v in x_levels])
    axis.set_xlabel(words(x))
    axis.set_ylabel(title(y))
    axis.margins(y=0.08)
    axis.legend(title=words(by), ncol=min(5, len(by_levels)), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure
