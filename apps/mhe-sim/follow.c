/* SPDX-License-Identifier: Apache-2.0 */
/* follow.c: given postures; the muscle controls are found on the way. */
#include "base/pi.h"
#include "estimator/columns.h"
#include "estimator/create.h"
#include "motion.h"
#include "simulation.h"

#include <math.h>
#include <string.h>

/* s a frame, in the place of a limit of work: a truth is solved to its end */
#define NO_LIMIT 1e6

typedef struct follow {
    const motion_setup *setup;
    mhe_estimator *estimator;
    simulation simulation;
    mhi_table *postures;
    int32_t *column;    /* [n_q] */
    double *q, *marker; /* of the path */
} follow;

static mhe_status open_postures(follow *f, mhe_error *err) {
    static const mhi_naming naming = {"coordinate", {"q_%s", "%s", "q%d"}, 1};
    simulation *s = &f->simulation;
    const mhe_problem *problem = mhi_ocp_problem(mhi_estimator_ocp(f->estimator));
    mhe_status status = mhi_sto_read(f->setup->input, &f->postures, err);
    if (status != MHE_OK) {
        return status;
    }
    int32_t found = 0;
    uint8_t *used = MHI_TAKE(&s->arena, uint8_t, f->postures->n_columns);
    f->column = MHI_TAKE(&s->arena, int32_t, s->n_q);
    f->q = MHI_TAKE(&s->arena, double, s->n_q);
    f->marker = MHI_TAKE(&s->arena, double, 3 * problem->n_markers);
    if (!used || !f->column || !f->q || !f->marker) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    status =
        mhi_columns_match(f->postures, &naming, problem->coordinate_names, s->n_q,
                          f->postures->n_columns, f->column, used, &found, f->setup->host, err);
    if (status == MHE_OK && found < s->n_q) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: %d of the model's %d coordinates have a column",
                          f->postures->path, found, s->n_q);
    }
    return status;
}

/* Fraction of the way on a minimum-jerk path at a fraction of its time. */
static double minimum_jerk(double t) {
    return t * t * t * (10 - 15 * t + 6 * t * t);
}

/* The path's posture at a time; it rests after the last row. */
static void posture_at(const follow *f, double time, double *q) {
    const mhi_table *p = f->postures;
    int32_t row = 0;
    while (row + 2 < p->n_rows && p->time[row + 1] <= time) {
        row++;
    }
    const int32_t next = row + 1 < p->n_rows ? row + 1 : row;
    const double span = next > row ? p->time[next] - p->time[row] : 1;
    const double way = minimum_jerk(fmin(fmax((time - p->time[row]) / span, 0), 1));
    const mhe_coordinate *c = mhi_system_description(f->simulation.system)->coordinates;
    for (int32_t i = 0; i < f->simulation.n_q; i++) {
        const double from = p->values[(ptrdiff_t)row * p->n_columns + f->column[i]];
        const double to = p->values[(ptrdiff_t)next * p->n_columns + f->column[i]];
        const double unit = p->in_degrees && c[i].rotational ? MHI_PI / 180 : 1;
        q[i] = (from + (to - from) * way) * unit;
    }
}

/* Shows the window the markers of the path at a time; `ready`: it has been solved. */
static mhe_status look_ahead(follow *f, double time, mhe_estimate *estimate, int32_t *ready,
                             mhe_error *err) {
    posture_at(f, time, f->q);
    mhe_status status = mhi_system_markers(f->simulation.context, f->q, f->marker, NULL, err);
    const mhe_frame frame = {.size = sizeof frame, .time = time, .markers = f->marker};
    return status == MHE_OK ? mhe_estimator_push(f->estimator, &frame, estimate, ready, err)
                            : status;
}

static void take_controls(follow *f, const mhe_estimate *estimate) {
    simulation *s = &f->simulation;
    const double *u = estimate->excitation != NULL ? estimate->excitation : estimate->activation;
    for (int32_t i = 0; i < s->n_m; i++) {
        s->u[i] = fmin(fmax(u[i], 0), 1);
    }
    const mhe_layout *layout = mhi_system_face(s->system)->layout;
    const mhe_block *drive = mhe_layout_find(layout, MHE_ROLE_CONTROL, "actuator");
    if (drive != NULL) { /* motors are part of the model; residual torques are not */
        memcpy(s->u + drive->first, estimate->controls + drive->first,
               sizeof(double) * (size_t)drive->count);
    }
}

static mhe_status follow_path(follow *f, mhe_error *err) {
    simulation *s = &f->simulation;
    const mhi_table *p = f->postures;
    const int32_t window = f->setup->run->horizon.window;
    int32_t n = 0;
    mhe_status status = simulation_steps(s, p, &n, err);
    if (status == MHE_OK) {
        status = mhe_estimator_covers(f->estimator, p->time[0], p->time[0] + (n + window) / s->rate,
                                      0, err);
    }
    posture_at(f, p->time[0], f->q);
    memset(s->x_next, 0, sizeof(double) * (size_t)s->n_q);
    mhi_estimator_set_start(f->estimator, f->q, s->x_next);
    mhi_estimator_set_outlier(f->estimator, 0);
    mhi_estimator_set_deadline(f->estimator, NO_LIMIT);
    for (int32_t ahead = 0; ahead <= n + window && status == MHE_OK; ahead++) {
        const int32_t k = ahead - window; /* the window's first node */
        const double time = p->time[0] + k / s->rate;
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = look_ahead(f, p->time[0] + ahead / s->rate, &estimate, &ready, err);
        if (status != MHE_OK || k < 0) {
            continue;
        }
        if (k == 0) {
            memcpy(s->x, estimate.q, sizeof(double) * (size_t)s->n_q);
            memcpy(s->x + s->n_q, estimate.qdot, sizeof(double) * (size_t)s->n_q);
            status = mhi_system_close_loops(s->context, s->x, s->x + s->n_q, err);
            if (status == MHE_OK) {
                status = mhi_system_equilibrium(s->context, s->x, s->x + s->n_q,
                                                estimate.activation, s->x, err);
            }
        }
        if (status != MHE_OK) {
            return status;
        }
        take_controls(f, &estimate);
        status = simulation_write(s, time, err);
        if (status == MHE_OK && k < n) {
            status = simulation_step(s, time, err);
            mhi_estimator_set_state(f->estimator, s->x);
        }
    }
    return status;
}

mhe_status motion_follow(const motion_setup *setup, mhe_error *err) {
    follow f = {.setup = setup};
    if (setup->run->horizon.ratio != 1) {
        return mhe_fail(
            err, MHE_E_CONFIG,
            "%s: horizon.ratio is %d; to follow a path it must be 1 (--rate sets the step)",
            setup->run->path, setup->run->horizon.ratio);
    }
    if (setup->run->output.node != 0) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "%s: output.node is '%s'; to follow a path it is 'first'", setup->run->path,
                        setup->run->output.node_name);
    }
    mhe_status status = mhi_estimator_create(setup->run, setup->host, &f.estimator, err);
    if (status == MHE_OK) {
        status = simulation_open(&f.simulation, setup->run, mhi_estimator_system(f.estimator),
                                 setup->host, setup->registry, setup->rate, err);
    }
    if (status == MHE_OK) {
        status = open_postures(&f, err);
    }
    if (status == MHE_OK) {
        status = simulation_files(&f.simulation, setup->out, setup->input, err);
    }
    if (status == MHE_OK) {
        status = follow_path(&f, err);
    }
    if (status == MHE_OK) {
        status = simulation_commit(&f.simulation, err);
    }
    mhi_table_free(f.postures);
    simulation_close(&f.simulation);
    mhe_estimator_close(f.estimator);
    return status;
}
