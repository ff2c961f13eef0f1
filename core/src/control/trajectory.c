/* SPDX-License-Identifier: Apache-2.0 */
#include "control/trajectory.h"

#include <math.h>
#include <string.h>

mhe_status mhi_trajectory_take(mhi_arena *arena, const mhe_system *system, int32_t n,
                               double interval, mhi_trajectory *out, mhe_error *err) {
    *out = (mhi_trajectory){.n = n, .n_x = system->n_x, .n_u = system->n_u, .interval = interval};
    out->x = MHI_TAKE(arena, double, (ptrdiff_t)(n + 1) * system->n_x);
    out->u = MHI_TAKE(arena, double, (ptrdiff_t)n * system->n_u);
    return out->x == NULL || out->u == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static void at(const mhi_trajectory *m, double time, double *x, double *u) {
    const double place = fmin(fmax(time / m->interval, 0), m->n);
    const double near = round(place);
    const double exact = fabs(place - near) < 1e-6 ? near : place; /* a node is a node */
    const int32_t k = exact >= m->n ? m->n - 1 : (int32_t)exact;
    const double part = exact - k;
    const double *row = m->x + (ptrdiff_t)k * m->n_x;
    for (int32_t i = 0; i < m->n_x && x != NULL; i++) {
        x[i] = row[i] + part * (row[m->n_x + i] - row[i]);
    }
    if (u != NULL) {
        memcpy(u, m->u + (ptrdiff_t)k * m->n_u, sizeof(double) * (size_t)m->n_u);
    }
}

void mhi_trajectory_at(const mhi_trajectory *const *motions, int32_t n_motions, double time,
                       double *x, double *u) {
    for (int32_t i = 0; i < n_motions; i++) {
        const double duration = motions[i]->n * motions[i]->interval;
        if (i == n_motions - 1 || time < duration - 1e-6 * motions[i]->interval) {
            at(motions[i], time, x, u);
            return;
        }
        time -= duration;
    }
}

double mhi_trajectory_duration(const mhi_trajectory *const *motions, int32_t n_motions) {
    double duration = 0;
    for (int32_t i = 0; i < n_motions; i++) {
        duration += motions[i]->n * motions[i]->interval;
    }
    return duration;
}

int32_t mhi_part_find(const mhe_system *f, const char *name, mhi_part *part) {
    static const int32_t roles[] = {MHE_ROLE_STATE, MHE_ROLE_CONTROL};
    for (int32_t i = 0; i < 2; i++) {
        const mhe_block *block = mhe_layout_find(f->layout, roles[i], name);
        if (block != NULL && block->count > 0) {
            *part = (mhi_part){roles[i] == MHE_ROLE_CONTROL, block->first, block->count,
                               block->entry_names, block->units};
            return 1;
        }
    }
    return 0;
}
