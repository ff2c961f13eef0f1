/* SPDX-License-Identifier: Apache-2.0 */
/* variant.c: the forces that muscles would have if their lengths were others. */
#include "model/system_private.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

struct mhi_variant {
    const mhe_muscle_ops *ops;
    void *self;
    mhe_muscle *muscles; /* [n_m] */
    mhi_arena arena;
};

/* What a muscle does not have stays NaN. */
static void change(const mhi_system *s, const mhi_variation *by, mhe_muscle *muscles) {
    memcpy(muscles, s->muscles, sizeof *muscles * (size_t)s->face.n_m);
    for (int32_t m = 0; m < s->face.n_m; m++) {
        double *fiber = &muscles[m].optimal_fiber_length, *slack = &muscles[m].tendon_slack_length;
        const double of_fiber = by->fiber * *fiber;
        const double of_tendon = isnan(*slack) ? by->path : hypot(by->tendon * *slack, by->path);
        const double all = hypot(of_fiber, of_tendon);
        if (all > 0) {
            *fiber -= by->far * of_fiber * of_fiber / all;
            *slack = fmax(0, *slack - by->far * of_tendon * of_tendon / all);
        }
    }
}

mhe_status mhi_variant_create(const mhi_system *s, const mhi_variation *by, mhi_variant **variant,
                              mhe_error *err) {
    mhi_arena arena = {0};
    mhi_variant *v = MHI_TAKE(&arena, mhi_variant, 1);
    *variant = NULL;
    if (v == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    v->ops = s->muscle;
    v->muscles = MHI_TAKE(&arena, mhe_muscle, s->face.n_m);
    v->arena = arena;
    mhe_status status = v->muscles == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    if (status == MHE_OK) {
        mhe_muscle_layout layout;
        change(s, by, v->muscles);
        status = mhi_muscle_create(s->muscle_plugin, &s->host, v->muscles, s->face.n_m,
                                   s->muscle_config, &v->self, &layout, err);
    }
    if (status != MHE_OK) {
        mhi_variant_free(v);
        return status;
    }
    *variant = v;
    return MHE_OK;
}

void mhi_variant_free(mhi_variant *v) {
    if (v != NULL) {
        mhi_arena arena = v->arena;
        if (v->self != NULL) {
            v->ops->destroy(v->self);
        }
        mhi_arena_free(&arena);
    }
}

mhe_status mhi_variant_forces(const mhi_variant *v, const double *activation, const double *length,
                              const double *velocity, double *force, mhe_error *err) {
    const mhe_muscle_point at = {
        .size = sizeof at, .state = activation, .length = length, .velocity = velocity};
    const mhe_muscle_values out = {.size = sizeof out, .force = force};
    return v->ops->evaluate(v->self, &at, &out, err);
}
