/* SPDX-License-Identifier: Apache-2.0 */
#include "base/pi.h"
#include "base/text.h"
#include "believe/believe.h"
#include "believe/pose.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STRONGEST 2e4   /* N: the strongest muscles of a person bear less */
#define IMPOSSIBLE 1e6  /* N */
#define LONGEST 2.0     /* optimal lengths of a fibre: beyond it tears */
#define SHORTEST 0.3    /* below it no filaments overlap */
#define STEEPEST 1.05   /* rad, 60 degrees: people's muscles reach 30 */
#define COINCIDE 1e-6   /* m */
#define ARM_SHARE 0.1   /* of the body's mass: an arm is 5 % (de Leva 1996, 29, 1223-1230) */
#define WHOLE_BODY 20.0 /* kg: a model with a trunk */
#define HEAVIEST 300.0  /* kg */
#define NAMED 5

typedef struct list {
    mhi_text names;
    int32_t n;
} list;

MHE_PRINTF(2, 3)
static void add(list *l, const char *format, ...) {
    char text[256];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (l->n++ < NAMED) {
        mhi_text_add(&l->names, "%s%s", l->n == 1 ? "" : ", ", text);
    }
}

static void tell(list *l, const mhe_description *d, int32_t weight, const char *remedy,
                 const char *what, mhi_findings *findings) {
    if (l->n > 0 && l->names.data != NULL) {
        mhi_findings_add(findings, weight, remedy, "%s: %s: %s%s", d->source, what, l->names.data,
                         l->n > NAMED ? ", ..." : "");
    }
    mhi_text_free(&l->names);
}

static int32_t has_no_length(const mhe_path *m) {
    for (int32_t i = 1; i < m->n_points; i++) {
        const mhe_path_point *a = &m->points[i - 1], *b = &m->points[i];
        double squares = 0;
        for (int32_t k = 0; k < 3; k++) {
            squares += (a->location[k] - b->location[k]) * (a->location[k] - b->location[k]);
        }
        if (a->body != b->body || squares > COINCIDE * COINCIDE) {
            return 0;
        }
    }
    return 1;
}

static int32_t all_at_one_place(const mhe_path *m) {
    for (int32_t i = 0; i < m->n_points; i++) {
        for (int32_t k = 0; k < 3; k++) {
            if (fabs(m->points[i].location[k] - m->points[0].location[k]) > COINCIDE) {
                return 0;
            }
        }
    }
    return 1;
}

static void check_muscles(const mhe_description *d, mhi_findings *findings) {
    list strong = {{0}, 0}, impossible = {{0}, 0}, slack = {{0}, 0}, points = {{0}, 0},
         steep = {{0}, 0};
    for (int32_t i = 0; i < d->n_muscles; i++) {
        const mhe_muscle *m = &d->muscles[i];
        if (m->max_isometric_force > STRONGEST) {
            add(m->max_isometric_force > IMPOSSIBLE ? &impossible : &strong, "%s (line %d: %.3g N)",
                m->name, (int)m->line, m->max_isometric_force);
        }
        if (m->tendon_slack_length == 0) {
            add(&slack, "%s", m->name);
        }
        if (m->pennation_angle > STEEPEST) {
            add(&steep, "%s (line %d: %.0f degrees)", m->name, (int)m->line,
                m->pennation_angle * 180 / MHI_PI);
        }
        const mhe_path *path = &d->paths[i];
        if (path->n_points > 1 && (has_no_length(path) || all_at_one_place(path))) {
            add(&points, "%s", m->name);
        }
    }
    tell(&impossible, d, MHI_FINDING_USELESS, "correct max_isometric_force (N)",
         "muscles beyond belief", findings);
    tell(&strong, d, MHI_FINDING_DOUBTFUL, "correct max_isometric_force (N)",
         "muscles stronger than any person's", findings);
    tell(&slack, d, MHI_FINDING_NOTE, "right only where there is no tendon",
         "muscles with tendon slack length 0", findings);
    tell(&steep, d, MHI_FINDING_DOUBTFUL, "correct pennation_angle_at_optimal (rad)",
         "fibres that stand across their tendon", findings);
    tell(&points, d, MHI_FINDING_DOUBTFUL, "correct the path points",
         "muscles whose path points coincide", findings);
}

static int32_t is_of_arm(const char *name) {
    static const char *const words[] = {"humer",    "radius",   "ulna",      "forearm",  "hand",
                                        "upperarm", "lowerarm", "upper_arm", "lower_arm"};
    char low[64];
    size_t n = strlen(name) < sizeof low - 1 ? strlen(name) : sizeof low - 1;
    for (size_t i = 0; i < n; i++) {
        low[i] = (char)tolower((unsigned char)name[i]);
    }
    low[n] = '\0';
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strstr(low, words[i]) != NULL) {
            return 1;
        }
    }
    return 0;
}

static void check_masses(const mhe_description *d, mhi_findings *findings) {
    double total = 0, arm = 0;
    int32_t n_upper = 0;
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const int32_t of_arm = is_of_arm(d->bodies[i].name);
        total += d->bodies[i].mass;
        arm += of_arm ? d->bodies[i].mass : 0;
        n_upper += of_arm &&
                   (strstr(d->bodies[i].name, "umer") != NULL ||
                    strstr(d->bodies[i].name, "pper") != NULL) &&
                   d->bodies[i].mass > 0.1;
    }
    const int32_t arms = n_upper > 1 ? 2 : 1;
    if (total > HEAVIEST) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL, "masses are in kg",
                         "%s: the model weighs %.4g kg", d->source, total);
    } else if (total > WHOLE_BODY && arm / arms > ARM_SHARE * total) {
        mhi_findings_add(findings, MHI_FINDING_NOTE,
                         "check the masses: the moments at the shoulder follow from them",
                         "%s: an arm is %.0f %% of the model's mass, of a body's it is 5 %%",
                         d->source, 100 * arm / arms / total);
    }
}

/* Bounds that leave the controls nothing to choose: the motion follows from its first state. */
static void check_bounds(const mhi_run *run, mhi_findings *findings) {
    const mhi_bounds_section *b = &run->bounds;
    const int32_t by_activation = run->formulation == MHE_FORMULATION_ACTIVATION;
    const double least = by_activation ? b->activation_min : b->excitation_min;
    const double most = by_activation ? b->activation_max : b->excitation_max;
    const char *name = by_activation ? "activation" : "excitation";
    if (least == most && !b->residual_torques && !b->actuators) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "give them a range, or let bounds.residual_torques follow the motion",
                         "bounds: %s_min and %s_max are both %g: the controls are fixed, and no "
                         "motion but one can be followed",
                         name, name, least);
    }
}

/* Fibre lengths at the postures [n x n_q], by a tendon that does not give. */
static mhe_status check_fibres(const mhi_system *system, const double *q, int32_t n,
                               mhi_findings *findings, mhe_error *err) {
    const mhe_description *d = mhi_system_description(system);
    mhi_system_context *context = NULL;
    const mhe_system *face = mhi_system_face(system);
    double *zero = calloc((size_t)(d->n_coordinates + d->n_muscles + face->n_z) + 1, sizeof *zero);
    double *span = calloc(2 * (size_t)d->n_muscles + 1, sizeof *span);
    mhe_status status = zero == NULL || span == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_system_context_create(system, &context, err);
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        mhi_muscle_state state;
        const mhe_system_point at = {.size = sizeof at,
                                     .q = q + (ptrdiff_t)k * d->n_coordinates,
                                     .v = zero,
                                     .a = zero,
                                     .z = zero,
                                     .c = zero};
        status = mhi_system_muscles(context, &at, 0, &state, err);
        for (int32_t i = 0; i < d->n_muscles && status == MHE_OK; i++) {
            const mhe_muscle *m = &d->muscles[i];
            const double along =
                (state.length[i] - m->tendon_slack_length) / m->optimal_fiber_length;
            const double across = sin(m->pennation_angle);
            const double length = along > 0 ? sqrt(along * along + across * across) : along;
            span[2 * i] = k == 0 ? length : fmin(span[2 * i], length);
            span[2 * i + 1] = k == 0 ? length : fmax(span[2 * i + 1], length);
        }
    }
    list odd = {{0}, 0};
    for (int32_t i = 0; i < d->n_muscles && status == MHE_OK && n > 0; i++) {
        if (span[2 * i] < SHORTEST || span[2 * i + 1] > LONGEST) {
            add(&odd, "%s (%.2f to %.2f)", d->muscles[i].name, span[2 * i], span[2 * i + 1]);
        }
    }
    tell(&odd, d, MHI_FINDING_NOTE,
         "their forces follow from lengths that no fibre has: check optimal fibre and tendon slack "
         "lengths",
         "fibres that go beyond their range in this motion (optimal lengths)", findings);
    mhi_system_context_free(context);
    free(zero);
    free(span);
    return status == MHE_RETRY ? MHE_OK : status;
}

mhe_status mhi_believe_model(const mhi_run *run, const mhi_system *system, const mhi_recording *r,
                             mhi_findings *findings, mhe_error *err) {
    const mhe_description *d = mhi_system_description(system);
    mhi_pose_search *s = NULL;
    check_bounds(run, findings);
    check_muscles(d, findings);
    check_masses(d, findings);
    mhe_status status = mhi_pose_open(system, r, &s, err);
    if (status == MHE_OK && s != NULL) {
        const mhi_pose identity = mhi_pose_identity();
        int32_t n = 0;
        if (!isnan(mhi_pose_fit(s, &identity, 1))) {
            const double *q = mhi_pose_postures(s, &n);
            status = check_fibres(system, q, n, findings, err);
        }
    }
    mhi_pose_close(s);
    return status;
}
