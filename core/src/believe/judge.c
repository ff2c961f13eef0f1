/* SPDX-License-Identifier: Apache-2.0 */
/* judge.c: is an estimate usable? From how it fits what was measured, never from a known truth. */
#include "base/text.h"
#include "base/values.h"
#include "believe/diagnosis_private.h"

#include <stdlib.h>
#include <string.h>

#define MOST_CONVERGED 0.75 /* of the windows; below it estimates are whatever the solver had */
#define FEW_PREDICTED 0.02
#define MANY_PREDICTED 0.2
#define MARKERS_FAR \
    0.008 /* m RMS over all markers: angles may be 2 degrees off (docs/believability.md) */
#define MARKERS_LOST 0.06
#define LATE 0.04        /* s that EMG seems late; the electromechanical delay is as large */
#define EARLY (-0.02)    /* s */
#define LATE_SHARE 0.15  /* of the difference that this explains at least */
#define LONG 0.1         /* s between nodes: excitation does not change there */
#define MARKER_FAR 0.025 /* m RMS of a single one, and ... */
#define STANDS_OUT 3.0   /* ... times the median marker's */
#define DOUBTED 0.2      /* of a marker's or channel's samples not believed */
#define EMG_FAR 0.025    /* RMS over all muscles, of 1: forces may be 10 N off */
#define MUSCLE_FAR 0.15  /* RMS of a single one, of 1 */
#define AT_BOUND_OFTEN 0.1
#define AT_END_OFTEN 0.1
#define TORQUE_LARGE 1.0 /* times the muscles' moment, RMS */
#define TORQUE_LEAST 1.0 /* N m */
#define LIFTS 0.2        /* of the body's weight by a residual force that holds it up */
#define PUSHES 0.05 /* of the body's weight by any residual force at a free base, RMS, and ... */
#define TURNS 0.04  /* ... m of lever arm of it by a moment: Hicks et al. (2015, */
                    /* doi:10.1115/1.4029304) call more than 25 N and 50 N m bad in walking */

mhi_channel_tally mhi_diagnosis_marker(const mhi_diagnosis *d, int32_t i) {
    const mhi_tally *t = &d->markers[i];
    return (mhi_channel_tally){t->n, t->left_out, t->n == 0 ? NAN : mhi_tally_rms(t)};
}

mhi_channel_tally mhi_diagnosis_muscle(const mhi_diagnosis *d, int32_t i) {
    const mhi_tally *t = &d->muscles[i];
    return (mhi_channel_tally){t->n, t->left_out, t->n == 0 ? NAN : mhi_tally_rms(t)};
}

static void judge_solves(const mhi_diagnosis *d, const char *unmet, mhi_findings *findings) {
    const double converged = (double)d->n_converged / d->n;
    const double predicted = (double)d->n_predicted / d->n;
    if (predicted > FEW_PREDICTED) {
        mhi_findings_add(
            findings, predicted > MANY_PREDICTED ? MHI_FINDING_USELESS : MHI_FINDING_DOUBTFUL,
            "what was measured does not fit the model, or its bounds, there; quality.sto says when",
            "%.3g %% of the windows could not be solved: the model's prediction stands "
            "there%s%s%s",
            100 * predicted, *unmet != '\0' ? " (" : "", unmet, *unmet != '\0' ? ")" : "");
    }
    if (converged + predicted < MOST_CONVERGED) {
        mhi_findings_add(
            findings, MHI_FINDING_DOUBTFUL,
            "allow more iterations (the solver's max_iterations), a longer deadline, or "
            "find what of the data does not fit",
            "%.3g %% of the windows converged", 100 * converged);
    }
}

static void judge_markers(const mhi_diagnosis *d, mhi_findings *findings) {
    const mhe_estimator_info *f = d->info;
    double *each = malloc(sizeof *each * ((size_t)f->n_markers + 1)), squares = 0;
    int32_t n = 0, n_seen = 0;
    for (int32_t i = 0; i < f->n_markers && each != NULL; i++) {
        if (d->markers[i].n > 0) {
            each[n_seen++] = mhi_tally_rms(&d->markers[i]);
            squares += d->markers[i].squares;
            n += d->markers[i].n;
        }
    }
    if (n_seen == 0) {
        free(each);
        return;
    }
    mhi_sort(each, n_seen);
    const double all = sqrt(squares / n), median = each[(n_seen - 1) / 2];
    if (all > MARKERS_FAR) {
        mhi_findings_add(findings, all > MARKERS_LOST ? MHI_FINDING_USELESS : MHI_FINDING_DOUBTFUL,
                         "is the model scaled to this person, do labels and markers' places agree?",
                         "the markers are %.1f mm from the estimate (RMS)", 1e3 * all);
    }
    const mhi_stretch *w = &d->worst;
    const double part = w->n > 0 ? sqrt(w->squares / w->n) : 0;
    if (all <= MARKERS_FAR && part > MARKERS_FAR) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "what changed there: the system, a marker, the person's place?",
                         "the markers are %.1f mm from the estimate (RMS) from %.4g to %.4g s, "
                         "%.1f mm over all",
                         1e3 * part, w->from, w->to, 1e3 * all);
    }
    for (int32_t i = 0; i < f->n_markers; i++) {
        const double rms = mhi_tally_rms(&d->markers[i]);
        const int32_t left_out = d->markers[i].left_out;
        if (d->markers[i].n > 0 && rms > MARKER_FAR && rms > STANDS_OUT * median) {
            mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                             "check its place on the model, and its label",
                             "marker %s is %.0f mm from the estimate (RMS), the others %.0f mm",
                             f->marker_names[i], 1e3 * rms, 1e3 * median);
        } else if (left_out > DOUBTED * d->n) {
            mhi_findings_add(
                findings, MHI_FINDING_DOUBTFUL,
                "check its label; data.marker_outlier is the distance",
                "marker %s is left out in %.0f %% of the estimates: too far from where "
                "the model expects it",
                f->marker_names[i], 100.0 * left_out / d->n);
        }
    }
    free(each);
}

static void judge_emg(const mhi_diagnosis *d, mhi_findings *findings) {
    const mhe_estimator_info *f = d->info;
    double squares = 0;
    int32_t n = 0, doubted = 0;
    mhi_text far = {0};
    for (int32_t i = 0; i < f->n_muscles; i++) {
        const mhi_tally *t = &d->muscles[i];
        squares += t->squares;
        n += t->n;
        doubted += t->left_out;
        if (t->n > 0 && mhi_tally_rms(t) > MUSCLE_FAR) {
            mhi_text_add(&far, "%s%s %.2f", far.length == 0 ? "" : ", ", f->muscle_names[i],
                         mhi_tally_rms(t));
        }
    }
    if (far.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "check electrode, MVC value and mapping of these channels",
                         "EMG and estimate disagree (RMS, of 1): %s", far.data);
    } else if (n > 0 && sqrt(squares / n) > EMG_FAR) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "check the MVC values, and that EMG and markers have one clock "
                         "(data.emg_offset)",
                         "EMG and estimate are %.3f apart (RMS, of 1)", sqrt(squares / n));
    }
    if (n > 0 && doubted > DOUBTED * n) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL, "data.emg_saturation says when",
                         "%.0f %% of the EMG is at the ends of its range and left out",
                         100.0 * doubted / n);
    }
    mhi_text_free(&far);
}

static void judge_times(const mhi_diagnosis *d, mhi_findings *findings) {
    double share;
    const double late = mhi_lag_seconds(&d->lag, &share);
    if (share > LATE_SHARE && (late > LATE || late < EARLY)) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "have EMG and markers one clock? data.emg_offset moves the EMG, delay of "
                         "an electrode is its electromechanical delay",
                         "the EMG seems %s by %.0f ms or more", late > 0 ? "late" : "early",
                         1e3 * fabs(late));
    }
    const double interval = d->info->ratio / d->recording->rate;
    if (interval > LONG) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "smaller horizon.ratio, or more frames a second",
                         "%.3g s between nodes: muscles change faster", interval);
    }
}

static void judge_bounds(const mhi_diagnosis *d, mhi_findings *findings) {
    const mhe_estimator_info *f = d->info;
    mhi_text full = {0}, ends = {0};
    for (int32_t i = 0; i < f->n_muscles; i++) {
        if (d->at_bound[i] > AT_BOUND_OFTEN * d->n) {
            mhi_text_add(&full, "%s%s (%.0f %%)", full.length == 0 ? "" : ", ", f->muscle_names[i],
                         100.0 * d->at_bound[i] / d->n);
        }
    }
    for (int32_t i = 0; i < f->n_q; i++) {
        if (d->at_end[i] > AT_END_OFTEN * d->n) {
            mhi_text_add(&ends, "%s%s (%.0f %%)", ends.length == 0 ? "" : ", ",
                         f->coordinate_names[i], 100.0 * d->at_end[i] / d->n);
        }
    }
    if (full.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "stronger muscles, residual torques at their joints, or EMG of the right "
                         "scale",
                         "muscles at full activation: %s", full.data);
    }
    if (ends.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "widen these ranges in the model, or check the markers' frame and labels",
                         "coordinates at an end of their range: %s", ends.data);
    }
    mhi_text_free(&full);
    mhi_text_free(&ends);
}

/* What a coordinate moves of the body that floats, which only loads can push. */
typedef enum base_motion { NOT_OF_A_BASE, SIDEWAYS, UP, TURN } base_motion;

static base_motion moves_base(const mhe_description *m, int32_t coordinate) {
    const double *g = m->gravity;
    const double size = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    base_motion is = NOT_OF_A_BASE;
    for (int32_t i = 0; i < m->n_bodies; i++) {
        int32_t floats = 0;
        for (int32_t k = 0; k < m->bodies[i].n_motions && m->bodies[i].parent < 0; k++) {
            const mhe_motion *o = &m->bodies[i].motions[k];
            const double along = g[0] * o->axis[0] + g[1] * o->axis[1] + g[2] * o->axis[2];
            const int32_t shifts = o->kind == MHE_MOTION_TRANSLATION && o->coordinate >= 0;
            const int32_t up = shifts && fabs(along) > 0.9 * size && size > 0;
            floats |= up;
            if (o->coordinate == coordinate) {
                is = up ? UP : shifts ? SIDEWAYS : TURN;
            }
        }
        if (is != NOT_OF_A_BASE) {
            return floats ? is : NOT_OF_A_BASE;
        }
    }
    return NOT_OF_A_BASE;
}

/* 1: told. */
static int32_t judge_base(const mhi_diagnosis *d, int32_t i, double weight,
                          mhi_findings *findings) {
    const base_motion is = moves_base(mhi_system_description(d->system), i);
    const double residual = mhi_tally_rms(&d->torques[i]);
    const char *name = d->info->coordinate_names[i];
    if (is == UP && residual > LIFTS * weight) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "a foot on the ground whose load is not given? data.external_loads",
                         "the residual force at %s is %.0f N (RMS), the body weighs %.0f N", name,
                         residual, weight);
    } else if ((is == UP || is == SIDEWAYS) && residual > PUSHES * weight) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "do the loads' directions, scale and times, and the model's mass, fit?",
                         "the residual force at %s is %.0f N (RMS), the body weighs %.0f N", name,
                         residual, weight);
    } else if (is == TURN && residual > TURNS * weight) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "do the loads' points, directions and times fit the motion?",
                         "the residual moment at %s is %.0f N m (RMS), nothing real gives it", name,
                         residual);
    } else {
        return 0;
    }
    return 1;
}

static void judge_torques(const mhi_diagnosis *d, mhi_findings *findings) {
    const mhe_estimator_info *f = d->info;
    const mhe_description *m = mhi_system_description(d->system);
    mhi_text large = {0};
    double weight = 0;
    for (int32_t i = 0; i < m->n_bodies; i++) {
        weight += 9.81 * m->bodies[i].mass;
    }
    for (int32_t i = 0; i < f->n_q; i++) {
        const double torque = mhi_tally_rms(&d->torques[i]);
        if (!judge_base(d, i, weight, findings) && m->coordinates[i].rotational &&
            torque > TORQUE_LEAST && torque > TORQUE_LARGE * mhi_tally_rms(&d->moments[i])) {
            mhi_text_add(&large, "%s%s %.1f N m (muscles %.1f)", large.length == 0 ? "" : ", ",
                         f->coordinate_names[i], torque, mhi_tally_rms(&d->moments[i]));
        }
    }
    if (large.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_NOTE,
                         "expected where muscles or supports are missing in the model",
                         "residual torques do more than the muscles (RMS): %s", large.data);
    }
    mhi_text_free(&large);
}

void mhi_diagnosis_judge(const mhi_diagnosis *d, const char *unmet, mhi_findings *findings) {
    if (d->n > 0) {
        judge_solves(d, unmet, findings);
        judge_markers(d, findings);
        judge_emg(d, findings);
        judge_times(d, findings);
        judge_bounds(d, findings);
        judge_torques(d, findings);
    }
}
