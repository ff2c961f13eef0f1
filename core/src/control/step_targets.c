/* SPDX-License-Identifier: Apache-2.0 */
/* step_targets.c: what a step is to be close to: an earlier step's result or a file. */
#include "base/pi.h"
#include "config/options_value.h"
#include "control/step_private.h"
#include "estimator/columns.h"

#include <math.h>
#include <string.h>

int32_t mhi_step_is_file(const char *source) {
    const char *dot = strrchr(source, '.');
    return dot != NULL && (strcmp(dot, ".sto") == 0 || strcmp(dot, ".mot") == 0);
}

/* One signal's target at node k. */
static double *target(mhi_step_work *w, const char *signal, int32_t k) {
    const mhe_problem *problem = mhi_ocp_problem(w->ocp);
    const int32_t number = problem->find_signal(problem, signal, NULL, NULL);
    return number < 0 ? NULL : mhi_ocp_target(w->ocp, number, k);
}

static mhe_status from_steps(mhi_step_work *w, const char *signal, const mhi_part *part,
                             const char *source, mhe_error *err) {
    const char *names[256];
    int32_t n = 0;
    char *text = mhi_arena_text(&w->arena, source), *rest = NULL;
    if (text == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (char *word = strtok_r(text, " ", &rest); word != NULL && n < 256;
         word = strtok_r(NULL, " ", &rest)) {
        if (mhi_step_find(w->setup->steps, w->setup->number, word) < 0) {
            return mhi_step_fail(w, MHE_E_CONFIG, err,
                                 "targets: '%s' is neither a step before this one nor a .sto file",
                                 word);
        }
        names[n++] = word;
    }
    const mhi_trajectory **motions = n > 0 ? mhi_step_motions(w, names, n) : NULL;
    if (motions == NULL) {
        return mhi_step_fail(w, MHE_E_CONFIG, err, "targets: '%s' has no source", signal);
    }
    for (int32_t k = 0; k <= w->step->intervals; k++) {
        mhi_trajectory_at(motions, n, k * w->interval, w->x, w->u);
        memcpy(target(w, signal, k), (part->in_u ? w->u : w->x) + part->offset,
               sizeof(double) * (size_t)part->n);
    }
    return MHE_OK;
}

static mhe_status from_file(mhi_step_work *w, const char *signal, const mhi_part *part,
                            const char *source, mhe_error *err) {
    static const struct {
        const char *signal;
        mhi_naming naming;
    } known[] = {{"q", {"coordinate", {"q_%s", "%s", "q%d"}, 1}},
                 {"qdot", {"speed", {"qdot_%s", "%s_u", "%s/speed", "qdot%d"}, 1}},
                 {"activation", {"activation", {"a_%s", "%s.activation", "%s/activation"}, 1}},
                 {"excitation", {"excitation", {"e_%s", "%s", "%s.excitation"}, 1}}};
    const mhi_naming *naming = NULL;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        naming = strcmp(known[i].signal, signal) == 0 ? &known[i].naming : naming;
    }
    if (naming == NULL) {
        return mhi_step_fail(w, MHE_E_CONFIG, err, "targets: '%s' cannot come from a file", signal);
    }
    const char **names = MHI_TAKE(&w->arena, const char *, part->n);
    int32_t *column = MHI_TAKE(&w->arena, int32_t, part->n), found = 0;
    const char *path = mhi_path_absolute(w->setup->run->dir, source, &w->arena);
    mhi_table *table = NULL;
    if (names == NULL || column == NULL || path == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < part->n; i++) {
        names[i] = part->names[i];
    }
    mhe_status status = mhi_sto_read(path, &table, err);
    uint8_t *used = status == MHE_OK ? MHI_TAKE(&w->arena, uint8_t, table->n_columns) : NULL;
    if (status == MHE_OK && used == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        status = mhi_columns_match(table, naming, names, part->n, table->n_columns, column, used,
                                   &found, w->setup->host, err);
    }
    for (int32_t k = 0; k <= w->step->intervals && status == MHE_OK; k++) {
        for (int32_t i = 0; i < part->n; i++) {
            const double time = table->time[0] + k * w->interval;
            const int angle = strncmp(part->units[i], "rad", 3) == 0;
            const double scale = table->in_degrees && angle ? MHI_PI / 180 : 1;
            target(w, signal, k)[i] =
                column[i] < 0 ? NAN : scale * mhi_column_at(table, column[i], time, part->in_u);
        }
    }
    mhi_table_free(table);
    return status;
}

mhe_status mhi_step_targets(mhi_step_work *w, mhe_error *err) {
    const mhe_text_map *targets = &w->step->targets;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < targets->n && status == MHE_OK; i++) {
        const char *signal = targets->keys[i], *source = targets->values[i];
        mhi_part part;
        if (!mhi_part_find(w->face, signal, &part) || target(w, signal, 0) == NULL) {
            return mhi_step_fail(w, MHE_E_CONFIG, err,
                                 "targets: '%s' is not q, qdot, activation, excitation or "
                                 "residual_torque of this problem",
                                 signal);
        }
        status = (mhi_step_is_file(source) ? from_file : from_steps)(w, signal, &part, source, err);
    }
    return status;
}
