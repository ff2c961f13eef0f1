/* SPDX-License-Identifier: Apache-2.0 */
/* believe_fit.c: one transform of all markers explains more than many misplaced ones. */
#include "base/pi.h"
#include "base/text.h"
#include "believe/believe.h"
#include "believe/exchange.h"
#include "believe/pose.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FAR 0.02        /* m RMS: further than skin and model make it; the whole search is done */
#define GAIN 0.5        /* share of the distance that a transform must leave at most ... */
#define WORTH 0.003     /* m by which it must be nearer at least */
#define HOPELESS 0.05   /* m RMS: no posture is near */
#define ROUNDS 40       /* steps of postures and transform together */
#define GLANCE 6        /* of them where axes are chosen */
#define LIKELY 8        /* axes that are looked at in all frames */
#define NEARLY 1.25     /* times the best one's distance: the simplest of them is the remedy */
#define SLIGHT_TURN 1.5 /* degrees */
#define SLIGHT_SHIFT 0.004 /* m */
#define SLIGHT_SCALE 0.02
#define LEAST_SCALE 1e-4 /* further apart are no two units that markers are written in */
#define UNIT 1.8         /* times: people differ less */
#define LARGE_TURN 15.0  /* degrees: as many are the joints off */
#define LARGE_SHIFT 0.1  /* m */
#define FITTING 0.005    /* m RMS: what explains so much is the explanation */
#define LYING 55.0       /* degrees from upright throughout */

typedef struct trial {
    mhi_pose pose;
    double rms;
    int32_t cost; /* how much it takes to write it down; right angles less than any number */
} trial;

/* The 24 turns by right angles, and those mirrored: number 0 is no turn. */
static mhi_pose right_angles(int32_t number, int32_t mirrored) {
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {2, 1, 0},
                                     {1, 0, 2}, {1, 2, 0}, {2, 0, 1}};
    mhi_pose p = mhi_pose_identity();
    const int *order = orders[number / 4];
    const int odd = number / 4 >= 1 && number / 4 <= 3;
    const int signs = number % 4;
    double sign[3] = {signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, 1};
    sign[2] = sign[0] * sign[1] * (odd ? -1 : 1) * (mirrored ? -1 : 1);
    memset(p.turn, 0, sizeof p.turn);
    for (int i = 0; i < 3; i++) {
        p.turn[3 * i + order[i]] = sign[i];
    }
    return p;
}

static double determinant(const double r[9]) {
    return r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
           r[2] * (r[3] * r[7] - r[4] * r[6]);
}

/* Axis (unit) and degrees of the proper turn in a pose: of a mirror, of its negative. */
static double axis_of(const mhi_pose *pose, double axis[3]) {
    double r[9];
    const double hand = determinant(pose->turn) < 0 ? -1 : 1;
    for (int i = 0; i < 9; i++) {
        r[i] = hand * pose->turn[i];
    }
    const double c = fmin(fmax((r[0] + r[4] + r[8] - 1) / 2, -1), 1);
    const double v[3] = {r[7] - r[5], r[2] - r[6], r[3] - r[1]};
    double size = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    int largest = 0;
    for (int i = 0; i < 3; i++) {
        axis[i] = size > 1e-6 ? v[i] / size : (i == 2);
        largest = r[4 * i] > r[4 * largest] ? i : largest;
    }
    if (size <= 1e-6 && c < 0) { /* half a turn: r = 2 a a' - 1 */
        const double a = sqrt(fmax((r[4 * largest] + 1) / 2, 0));
        for (int i = 0; i < 3; i++) {
            axis[i] = i == largest ? a : r[3 * largest + i] / (2 * a);
        }
    }
    return acos(c) * 180 / MHI_PI;
}

/* "rotate: x-90, shift: [...]", as the config takes it; scale -1 mirrors. */
static void write_transform(const mhi_pose *pose, mhi_text *out) {
    double axis[3], degrees = axis_of(pose, axis);
    const double hand = determinant(pose->turn) < 0 ? -1 : 1;
    int along = -1, n = 0;
    for (int i = 0; i < 3; i++) {
        along = fabs(axis[i]) > 1 - 1e-4 ? i : along;
    }
    mhi_text_add(out, "data.transform: {");
    if (degrees > SLIGHT_TURN && along >= 0) {
        mhi_text_add(out, "rotate: %c%.4g", "xyz"[along], axis[along] < 0 ? -degrees : degrees);
        n++;
    } else if (degrees > SLIGHT_TURN) {
        mhi_text_add(out, "rotate: [[%.6g, %.6g, %.6g], %.6g]", axis[0], axis[1], axis[2], degrees);
        n++;
    }
    const double *s = pose->shift;
    if (sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) > SLIGHT_SHIFT) {
        mhi_text_add(out, "%sshift: [%.3f, %.3f, %.3f]", n++ > 0 ? ", " : "", s[0], s[1], s[2]);
    }
    if (hand < 0 || fabs(pose->scale - 1) > SLIGHT_SCALE) {
        mhi_text_add(out, "%sscale: %.4g", n > 0 ? ", " : "", hand * pose->scale);
    }
    mhi_text_add(out, "}");
}

static int32_t is_slight(const mhi_pose *pose) {
    double axis[3];
    const double *s = pose->shift;
    return determinant(pose->turn) > 0 && axis_of(pose, axis) < SLIGHT_TURN &&
           sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) < SLIGHT_SHIFT &&
           fabs(pose->scale - 1) < SLIGHT_SCALE;
}

/* Keeps the better one, or where they are as good the simpler one. */
static void consider(trial *best, const mhi_pose *pose, double rms, int32_t cost) {
    const int better = rms < best->rms / NEARLY - 1e-4;
    const int simpler = rms < best->rms * NEARLY + 1e-4 && cost < best->cost;
    const int possible = pose->scale > LEAST_SCALE && pose->scale < 1 / LEAST_SCALE;
    if (!isnan(rms) && possible && (better || simpler || (cost == best->cost && rms < best->rms))) {
        *best = (trial){*pose, rms, cost};
    }
}

/* From the nearest postures, and from the default one: far away the nearest ones are all at the
 * ends of their ranges. *as_is: the distance before. */
static double adjust_from_both(mhi_pose_search *s, int32_t freedom, mhi_pose *pose, double *as_is) {
    mhi_pose rested = *pose;
    *as_is = mhi_pose_fit(s, pose, 1);
    const double rms = mhi_pose_adjust(s, freedom, ROUNDS, pose);
    const double other =
        mhi_pose_rest(s) == MHE_OK ? mhi_pose_adjust(s, freedom, ROUNDS, &rested) : NAN;
    if (!(rms <= other)) {
        *pose = isnan(other) ? *pose : rested;
        return isnan(other) ? rms : other;
    }
    return rms;
}

/* A turn, shift or scale that is near to none. */
static void try_near(mhi_pose_search *s, trial *best) {
    static const struct {
        int32_t freedom, cost;
    } ways[] = {{MHI_POSE_SHIFT, 3},
                {MHI_POSE_SCALE, 3},
                {MHI_POSE_TURN, 4},
                {MHI_POSE_TURN | MHI_POSE_SHIFT, 6}};
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        mhi_pose pose = mhi_pose_identity();
        double as_is;
        const double rms = adjust_from_both(s, ways[i].freedom, &pose, &as_is);
        consider(best, &pose, rms, ways[i].cost);
    }
}

/* What axes it is worth to look at in all frames: the nearest in a few, shifted or not. */
static int32_t choose_axes(mhi_pose_search *s, int32_t chosen[LIKELY]) {
    double distance[48];
    int32_t n = 0;
    mhi_pose_look(s, 1);
    for (int32_t i = 0; i < 48; i++) {
        mhi_pose pose = right_angles(i % 24, i / 24);
        const double as_is = mhi_pose_fit(s, &pose, 1);
        distance[i] = fmin(as_is, mhi_pose_adjust(s, MHI_POSE_SHIFT, GLANCE, &pose));
    }
    mhi_pose_look(s, 0);
    for (; n < LIKELY; n++) {
        int32_t nearest = -1;
        for (int32_t i = 0; i < 48; i++) {
            nearest = distance[i] < (nearest < 0 ? INFINITY : distance[nearest]) ? i : nearest;
        }
        if (nearest < 0) {
            break;
        }
        chosen[n] = nearest;
        distance[nearest] = INFINITY;
    }
    return n;
}

/* Other axes, other hands, each with and without a shift. */
static void try_axes(mhi_pose_search *s, trial *best) {
    int32_t chosen[LIKELY];
    const int32_t n = choose_axes(s, chosen);
    for (int32_t i = 0; i < n; i++) {
        const int32_t number = chosen[i] % 24, mirrored = chosen[i] / 24;
        mhi_pose pose = right_angles(number, mirrored);
        double axis[3];
        const double degrees = axis_of(&pose, axis);
        const int about_x = fabs(axis[0]) > 0.99 && degrees < 100;
        const int32_t cost = 1 + 4 * mirrored + (about_x || degrees < 1 ? 0 : 1);
        const mhi_pose unshifted = pose;
        double as_is;
        const double rms = adjust_from_both(s, MHI_POSE_SHIFT, &pose, &as_is);
        consider(best, &unshifted, as_is, cost);
        consider(best, &pose, rms, cost + 3);
    }
    mhi_pose pose = best->pose;
    (void)mhi_pose_fit(s, &pose, 1);
    double rms = mhi_pose_adjust(s, MHI_POSE_TURN | MHI_POSE_SHIFT, ROUNDS, &pose);
    consider(best, &pose, rms, 7);
    rms = mhi_pose_adjust(s, MHI_POSE_TURN | MHI_POSE_SHIFT | MHI_POSE_SCALE, ROUNDS, &pose);
    consider(best, &pose, rms, 9);
}

/* Another unit is a matter of the recording, another size mostly one of the model. */
static void tell_scale(const char *path, double scale, double as_is, double rms, int32_t weight,
                       mhi_findings *findings) {
    const int unit = scale > UNIT || scale < 1 / UNIT;
    mhi_findings_add(
        findings, weight, "",
        "%s: the markers are those of a body %.4g times as large as the model: %.1f mm "
        "from the nearest posture (RMS), %.1f mm if they are scaled (%s)",
        path, 1 / scale, 1e3 * as_is, 1e3 * rms,
        unit ? "another unit?" : "the model of another person?");
    mhi_findings_advise(findings, "%sdata.transform: {scale: %.4g}",
                        unit ? "" : "scale the model (mhe-model scale), or where it is right ",
                        scale);
}

static void tell_transform(const char *path, const trial *best, double as_is,
                           mhi_findings *findings) {
    const double *t = best->pose.shift;
    double axis[3];
    const double degrees = axis_of(&best->pose, axis);
    const double shift = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    const int far = as_is > HOPELESS || determinant(best->pose.turn) < 0 || degrees > LARGE_TURN ||
                    shift > LARGE_SHIFT;
    const int32_t weight = far ? MHI_FINDING_USELESS : MHI_FINDING_DOUBTFUL;
    mhi_text how = {0};
    write_transform(&best->pose, &how);
    if (determinant(best->pose.turn) < 0) {
        mhi_findings_add(findings, weight, "",
                         "%s: the markers are those of a mirrored body: %.1f mm from the nearest "
                         "posture (RMS), %.1f mm if they are mirrored back",
                         path, 1e3 * as_is, 1e3 * best->rms);
    } else if (degrees < SLIGHT_TURN && fabs(best->pose.scale - 1) > SLIGHT_SCALE) {
        tell_scale(path, best->pose.scale, as_is, best->rms, weight, findings);
        mhi_text_free(&how);
        return;
    } else if (degrees < SLIGHT_TURN) {
        mhi_findings_add(findings, weight, "",
                         "%s: all markers are off by the same %.3f %.3f %.3f m: %.1f mm from the "
                         "nearest posture (RMS), %.1f mm without (another origin?)",
                         path, -t[0], -t[1], -t[2], 1e3 * as_is, 1e3 * best->rms);
    } else {
        mhi_findings_add(findings, weight, "",
                         "%s: the markers are in another frame than the model%s: %.1f mm from the "
                         "nearest posture (RMS), %.1f mm if they are turned by %.4g degrees",
                         path,
                         degrees > 45 ? ", its vertical does not fit the model's gravity" : "",
                         1e3 * as_is, 1e3 * best->rms, degrees);
    }
    mhi_findings_advise(findings, "%s", how.data == NULL ? "" : how.data);
    mhi_text_free(&how);
}

/* A body that floats fits in any direction; then gravity tells which way is up. */
static void check_upright(mhi_pose_search *s, const char *path, double as_is,
                          mhi_findings *findings) {
    mhi_pose turned = right_angles(7, 0);
    const mhi_pose identity = mhi_pose_identity();
    const double other = mhi_pose_fit(s, &turned, 1);
    if (!(other < as_is * NEARLY + WORTH) || !(mhi_pose_tilt(s, &identity) > LYING)) {
        return;
    }
    trial best = {identity, mhi_pose_tilt(s, &identity), 0};
    for (int32_t number = 1; number < 24; number++) {
        const mhi_pose pose = right_angles(number, 0);
        double axis[3];
        const double tilt = mhi_pose_tilt(s, &pose);
        const int about_x = fabs(axis_of(&pose, axis) - 90) < 1 && fabs(axis[0]) > 0.99;
        if (tilt < best.rms - 5 || (about_x && tilt < best.rms + 5)) {
            best = (trial){pose, tilt, 0};
        }
    }
    if (best.rms < 0.5 * LYING) {
        mhi_text how = {0};
        write_transform(&best.pose, &how);
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL, "",
                         "%s: the body lies in every frame: the recording's vertical does not fit "
                         "the model's gravity",
                         path);
        mhi_findings_advise(findings, "%s", how.data == NULL ? "" : how.data);
        mhi_text_free(&how);
    }
}

/* Where no transform explains it: two labels exchanged, by which more comes right than by any
 * transform. 1: told. */
static int32_t tell_exchange(const char *path, const mhi_system *system, const mhi_recording *r,
                             const trial *best, double as_is, mhi_findings *findings) {
    const mhe_description *d = mhi_system_description(system);
    mhi_exchange pair;
    uint8_t *all = best->rms > FITTING ? malloc((size_t)d->n_markers + 1) : NULL;
    if (all == NULL) {
        return 0;
    }
    memset(all, 1, (size_t)d->n_markers);
    const int32_t n = mhi_exchange_find(system, r, all, &pair, 1);
    free(all);
    if (n == 0 || !(pair.fixed < GAIN * fmin(best->rms, as_is))) {
        return 0;
    }
    const char *a = d->markers[pair.a].name, *b = d->markers[pair.b].name;
    mhi_findings_add(findings, as_is > HOPELESS ? MHI_FINDING_USELESS : MHI_FINDING_DOUBTFUL, "",
                     "%s: markers %s and %s look exchanged: all markers are %.1f mm from the "
                     "nearest posture (RMS), %.1f mm with these labels exchanged",
                     path, a, b, 1e3 * pair.as_is, 1e3 * pair.fixed);
    mhi_findings_advise(findings, "data.labels: {%s: %s, %s: %s}", a, b, b, a);
    return 1;
}

mhe_status mhi_believe_fit(const mhi_run *run, const mhi_system *system, const mhi_recording *r,
                           mhi_findings *findings, mhe_error *err) {
    mhi_pose_search *s = NULL;
    const mhe_status status = mhi_pose_open(system, r, &s, err);
    if (status != MHE_OK || s == NULL) {
        return status;
    }
    const char *path = run->data.markers;
    const mhi_pose identity = mhi_pose_identity();
    const double as_is = mhi_pose_fit(s, &identity, 1);
    trial best = {identity, as_is, 0};
    if (mhi_pose_spent(s)) { /* the distance is not that of the nearest postures */
        mhi_findings_add(findings, MHI_FINDING_NOTE, "",
                         "%s: too many markers or coordinates to search for a common turn or shift",
                         path);
    } else if (!isnan(as_is)) {
        try_near(s, &best);
        if (as_is > FAR) {
            try_axes(s, &best);
        }
        if (as_is > FAR && tell_exchange(path, system, r, &best, as_is, findings)) {
            mhi_pose_close(s);
            return MHE_OK;
        } else if (best.rms < GAIN * as_is && as_is - best.rms > WORTH && !is_slight(&best.pose)) {
            tell_transform(path, &best, as_is, findings);
        } else if (as_is > HOPELESS) {
            mhi_findings_add(
                findings, MHI_FINDING_USELESS,
                "is this the model of that person, and does each label name its place?",
                "%s: the markers are %.0f mm from the nearest posture (RMS)", path, 1e3 * as_is);
        } else {
            check_upright(s, path, as_is, findings);
        }
    }
    mhi_pose_close(s);
    return MHE_OK;
}
