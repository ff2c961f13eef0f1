/* SPDX-License-Identifier: Apache-2.0 */
/* jacobian.c: exact derivatives against differences. */
#include "kit.h"

#include <math.h>
#include <string.h>

/* Column j of df/dx by central differences of fourth order. */
static int difference(mhi_function f, void *data, double *x, int32_t j, double step, int32_t n_y,
                      double *work, double *column) {
    static const double factor[] = {1.0, -8.0, 8.0, -1.0};
    static const double at[] = {-2.0, -1.0, 1.0, 2.0};
    const double here = x[j];
    int failed = 0;
    memset(column, 0, sizeof *column * (size_t)n_y);
    for (int k = 0; k < 4 && !failed; k++) {
        x[j] = here + at[k] * step;
        failed = f(data, x, work) != 0;
        for (int32_t i = 0; i < n_y; i++) {
            column[i] += factor[k] * work[i] / (12.0 * step);
        }
    }
    x[j] = here;
    return failed;
}

double mhi_jacobian_error(mhi_kit *kit, mhi_function f, void *data, const double *x, int32_t n_x,
                          int32_t n_y, const double *jacobian) {
    double *point = MHI_KIT_TAKE(kit, double, n_x);
    double *work = MHI_KIT_TAKE(kit, double, n_y), *column = MHI_KIT_TAKE(kit, double, n_y);
    double *scale = MHI_KIT_TAKE(kit, double, n_y);
    memcpy(point, x, sizeof *x * (size_t)n_x);
    if (f(data, point, scale) != 0) {
        return NAN;
    }
    for (int32_t i = 0; i < n_y; i++) {
        scale[i] = fmax(1e-4 * fabs(scale[i]), 1e-9); /* differences see no smaller slopes */
        for (int32_t j = 0; j < n_x; j++) {
            scale[i] = fmax(scale[i], fabs(jacobian[i * n_x + j]));
        }
    }
    double worst = 0;
    for (int32_t j = 0; j < n_x; j++) {
        double best = NAN; /* of the steps, for the whole column */
        for (double step = 1e-2; step > 1e-7; step /= 4) {
            if (difference(f, data, point, j, step, n_y, work, column)) {
                continue; /* too far out of the domain */
            }
            double error = 0;
            for (int32_t i = 0; i < n_y; i++) {
                const double off = fabs(column[i] - jacobian[i * n_x + j]) / scale[i];
                error = off > error || isnan(off) ? off : error;
            }
            best = error < best || isnan(best) ? error : best;
        }
        worst = best > worst || isnan(best) ? best : worst;
        if (isnan(worst)) {
            break;
        }
    }
    return worst;
}

/* ---- one block of a probe as a function of another ---- */

typedef struct partial {
    const mhi_probe *probe;
    const double *in[MHI_MAX_BLOCKS];
    double *out[MHI_MAX_BLOCKS];
    void *scratch;
    int32_t i, o;
} partial;

static int partial_call(void *data, const double *x, double *y) {
    partial *p = data;
    p->in[p->i] = x;
    for (int32_t k = 0; k < p->probe->n_out; k++) {
        memset(p->out[k], 0, sizeof(double) * (size_t)p->probe->out[k].n);
    }
    if (p->probe->call(p->probe->data, p->probe->worker[0], p->scratch, p->in, p->out, NULL) !=
        MHE_OK) {
        return -1;
    }
    memcpy(y, p->out[p->o], sizeof *y * (size_t)p->probe->out[p->o].n);
    return 0;
}

void mhi_probe_jacobian(mhi_kit *kit, const mhi_probe *probe, const double *const *in, int32_t i,
                        int32_t o, const double *jacobian, const char *check) {
    partial p = {.probe = probe, .i = i, .o = o};
    memcpy(p.in, in, sizeof *in * (size_t)probe->n_in);
    for (int32_t k = 0; k < probe->n_out; k++) {
        p.out[k] = MHI_KIT_TAKE(kit, double, probe->out[k].n);
    }
    p.scratch = mhi_kit_take(kit, probe->scratch_bytes);
    (void)mhi_kit_limit(
        kit, check,
        mhi_jacobian_error(kit, partial_call, &p, in[i], probe->in[i].n, probe->out[o].n, jacobian),
        MHI_JACOBIAN_LIMIT);
}
