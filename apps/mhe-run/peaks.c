/* SPDX-License-Identifier: Apache-2.0 */
#include "peaks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

mhe_status peaks_open(peaks *p, const mhe_estimator_info *info, mhe_error *err) {
    const int32_t n_j = info->n_joints, n_r = info->n_residual_torques;
    double *room = calloc((size_t)(3 * n_j + 2 * n_r) + 1, sizeof *room);
    *p = (peaks){.n_joints = n_j, .n_residuals = n_r, .force = room};
    if (room == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    p->moment = p->force + n_j;
    p->time = p->moment + n_j;
    p->residual = p->time + n_j;
    p->squares = p->residual + n_r;
    return MHE_OK;
}

void peaks_free(peaks *p) {
    free(p->force);
    *p = (peaks){0};
}

static double size(const double *xyz) {
    return sqrt(xyz[0] * xyz[0] + xyz[1] * xyz[1] + xyz[2] * xyz[2]);
}

/* Three inputs in a row that are "..._force_x" and its like. */
static void add_loads(peaks *p, const mhe_estimate *e) {
    for (int32_t b = 0; b < e->layout->n_blocks && e->inputs != NULL; b++) {
        const mhe_block *block = mhe_layout_at(e->layout, b);
        for (int32_t i = 0; block->role == MHE_ROLE_INPUT && i + 2 < block->count; i++) {
            const char *name = block->entry_names[i];
            const size_t n = strlen(name);
            const double force = n > 8 && strcmp(name + n - 8, "_force_x") == 0
                                     ? size(e->inputs + block->first + i)
                                     : NAN;
            p->load = fmax(p->load, force); /* not of NaN */
        }
    }
}

void peaks_add(peaks *p, const mhe_estimate *e) {
    for (int32_t i = 0; i < p->n_joints && e->reactions != NULL; i++) {
        const double force = size(e->reactions + 6 * i), moment = size(e->reactions + 6 * i + 3);
        p->time[i] = force > p->force[i] ? e->time : p->time[i];
        p->force[i] = fmax(p->force[i], force);
        p->moment[i] = fmax(p->moment[i], moment);
    }
    for (int32_t i = 0; i < p->n_residuals; i++) {
        p->residual[i] = fmax(p->residual[i], fabs(e->residual[i]));
        p->squares[i] += e->residual[i] * e->residual[i];
    }
    p->n_estimates++;
    add_loads(p, e);
}
