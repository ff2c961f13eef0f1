/* SPDX-License-Identifier: Apache-2.0 */
#include "believe/believe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FRAMES 20
#define DIFFER 5.0 /* N RMS between the reference's forces and this model's at its states */

/* The point of frame k of the reference; 0: something of it is not known. */
static int32_t point_at(const mhi_reference *t, int32_t k, int32_t n_q, int32_t n_m,
                        mhe_system_point *at) {
    at->q = t->q + (ptrdiff_t)k * n_q;
    at->v = t->qdot + (ptrdiff_t)k * n_q;
    at->a = t->activation + (ptrdiff_t)k * n_m;
    at->c = at->a;
    for (int32_t i = 0; i < n_q; i++) {
        if (isnan(at->q[i]) || isnan(at->v[i])) {
            return 0;
        }
    }
    for (int32_t i = 0; i < n_m; i++) {
        if (isnan(at->a[i])) {
            return 0;
        }
    }
    return 1;
}

void mhi_believe_reference(const mhi_run *run, const mhi_system *system, const mhi_recording *r,
                           mhi_findings *findings) {
    const mhe_description *d = mhi_system_description(system);
    const mhi_reference *t = &r->reference;
    const int32_t n_q = d->n_coordinates, n_m = d->n_muscles;
    mhi_system_context *context = NULL;
    double squares = 0;
    int32_t n = 0;
    if (!t->present || n_m == 0 || mhi_system_face(system)->n_z > 0 ||
        mhi_system_context_create(system, &context, NULL) != MHE_OK) {
        return; /* fibre states are not in the file */
    }
    for (int32_t f = 0; f < FRAMES; f++) {
        const int32_t k = (int32_t)((2 * f + 1) * (int64_t)r->n_frames / (2 * FRAMES));
        mhe_system_point at = {.size = sizeof at};
        mhi_muscle_state muscles;
        if (!point_at(t, k, n_q, n_m, &at) ||
            mhi_system_muscles(context, &at, 0, &muscles, NULL) != MHE_OK) {
            continue;
        }
        for (int32_t i = 0; i < n_m; i++) {
            const double force = t->force[(ptrdiff_t)k * n_m + i];
            if (!isnan(force)) {
                squares += (force - muscles.force[i]) * (force - muscles.force[i]);
                n++;
            }
        }
    }
    mhi_system_context_free(context);
    if (n > 0 && sqrt(squares / n) > DIFFER) {
        mhi_findings_add(
            findings, MHI_FINDING_NOTE,
            "forces can be compared only with the curves and parameters that made "
            "them: muscle.curves (the demo's are paper2021)",
            "%s: at the reference's own states this model's muscles give forces %.0f N "
            "(RMS) from the reference's",
            run->data.reference, sqrt(squares / n));
    }
}
