/* SPDX-License-Identifier: Apache-2.0 */
#include "gather.h"

#include "trial.h"
#include <mhe/outbox.h>

#include <stdlib.h>
#include <string.h>

static int is_failed(const row *r) {
    return strncmp(r->cells, "failed", 6) == 0;
}

/* Cell number `n` of a row, counted from 0. */
static double cell(const char *cells, int32_t n) {
    for (; n > 0 && cells != NULL; n--) {
        cells = strchr(cells, ',');
        cells = cells == NULL ? NULL : cells + 1;
    }
    return cells == NULL ? 0 : strtod(cells, NULL);
}

static int is_counted(const study *s, const row *r) {
    return !is_failed(r) && cell(r->cells, 2) >= s->keys.exclude_below;
}

static void add_head(const study *s, mhi_text *out) {
    for (int32_t i = 0; i < s->n_factors; i++) {
        mhi_text_add(out, "%s,", s->factors[i].name);
    }
    mhi_text_add(out, "trial");
}

static void add_condition(const study *s, const row *r, mhi_text *out) {
    for (int32_t i = 0; i < s->n_factors; i++) {
        mhi_text_add(out, "%s,", study_label(s, &s->conditions[r->task.condition], i));
    }
    mhi_text_add(out, "%d", (int)r->task.trial);
}

/* In quotes where it needs them (RFC 4180). */
static void add_reason(const char *reason, mhi_text *out) {
    if (reason[strcspn(reason, ",\"")] == '\0') {
        mhi_text_add(out, ",%s\n", reason);
        return;
    }
    mhi_text_add(out, ",\"");
    for (const char *c = reason; *c != '\0'; c++) {
        mhi_text_add(out, *c == '"' ? "\"\"" : "%c", *c);
    }
    mhi_text_add(out, "\"\n");
}

/* What the condition's config says, as columns where no factor is called the same. */
static const char *const run_columns[] = {"formulation", "window", "ratio", "solver"};
enum { FORMULATION, WINDOW, RATIO, SOLVER, N_RUN_COLUMNS };

static int is_factor(const study *s, const char *name) {
    for (int32_t i = 0; i < s->n_factors; i++) {
        if (strcmp(s->factors[i].name, name) == 0) {
            return 1;
        }
    }
    return 0;
}

static void add_run_cell(const mhi_run *run, int32_t column, mhi_text *out) {
    switch (column) {
    case FORMULATION:
        mhi_text_add(out, ",%s",
                     run->formulation == MHE_FORMULATION_ACTIVATION ? "activation" : "excitation");
        break;
    case WINDOW:
        mhi_text_add(out, ",%d", (int)run->horizon.window);
        break;
    case RATIO:
        mhi_text_add(out, ",%d", (int)run->horizon.ratio);
        break;
    default:
        mhi_text_add(out, ",%s", run->solver.plugin->id);
        break;
    }
}

static void add_result(const study *s, const row *r, mhi_text *out) {
    const condition *c = &s->conditions[r->task.condition];
    add_condition(s, r, out);
    mhi_text_add(out, ",%d,%d", (int)study_seed(s, c, r->task.trial), is_counted(s, r));
    for (int32_t i = 0; i < N_RUN_COLUMNS; i++) {
        if (!is_factor(s, run_columns[i])) {
            add_run_cell(c->run, i, out);
        }
    }
    mhi_text_add(out, ",%s", r->cells);
    add_reason(r->reason, out);
}

mhe_status gather(const study *s, const rows *r, const char *dir, mhe_error *err) {
    mhi_text results = {0}, timing = {0};
    add_head(s, &results);
    mhi_text_add(&results, ",seed,counted");
    for (int32_t i = 0; i < N_RUN_COLUMNS; i++) {
        if (!is_factor(s, run_columns[i])) {
            mhi_text_add(&results, ",%s", run_columns[i]);
        }
    }
    mhi_text_add(&results, "," TRIAL_RESULT_COLUMNS ",reason\n");
    add_head(s, &timing);
    mhi_text_add(&timing, "," TRIAL_TIMING_COLUMNS "\n");
    for (int32_t i = 0; i < r->n; i++) {
        add_result(s, &r->list[i], &results);
        add_condition(s, &r->list[i], &timing);
        mhi_text_add(&timing, ",%s\n", r->list[i].timing);
    }
    mhe_outbox *outbox = NULL;
    mhe_status status = results.failed || timing.failed
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhe_outbox_open(dir, &outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "results.csv", results.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "timing.csv", timing.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&results);
    mhi_text_free(&timing);
    return status;
}

void gather_tell(const study *s, const rows *r, mhi_text *out) {
    int32_t failed = 0, below = 0;
    double solves = 0, converged = 0;
    for (int32_t i = 0; i < r->n; i++) {
        const double n = cell(r->list[i].cells, 1);
        failed += is_failed(&r->list[i]);
        below += !is_failed(&r->list[i]) && !is_counted(s, &r->list[i]);
        solves += n;
        converged += n > 0 ? n * cell(r->list[i].cells, 2) : 0;
    }
    mhi_text_add(out,
                 "%d of %d trials, %.0f solves, %.2f %% converged; %d trials failed, %d under "
                 "%g %% converged\n",
                 (int)r->n, (int)s->n_trials, solves, solves > 0 ? 100 * converged / solves : 0.0,
                 (int)failed, (int)below, 100 * s->keys.exclude_below);
    if (r->n_differing > 0) {
        mhi_text_add(out, "%d trials were run twice, with different results: the machines differ\n",
                     (int)r->n_differing);
    }
}
