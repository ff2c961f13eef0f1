/* SPDX-License-Identifier: Apache-2.0 */
#include "program.h"

#include "base/number.h"
#include "base/pi.h"
#include "measure.h"
#include "process.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void program_describe(mhi_text *out) {
    mhi_text_add(
        out,
        "  A program is called with --condition 'factor=label ...', --trial N (0 ...), --seed N,\n"
        "  --out DIR (of this study), --bin DIR (these programs) and --set path.to.key=value for\n"
        "  all that the condition sets of the config, which comes last. It prints what came out,\n"
        "  'name value' a line; names are the columns of results.csv from 'converged' on.\n");
}

/* Where a column's number goes, and what it is times. */
static double *place_of(trial_result *r, const char *name, size_t length, double *unit) {
    const struct {
        const char *name;
        double *to, unit;
    } known[] = {{"q_deg", &r->rmse.q, MHI_PI / 180},
                 {"qdot_rad_s", &r->rmse.qdot, 1},
                 {"activation", &r->rmse.activation, 1},
                 {"excitation", &r->rmse.excitation, 1},
                 {"force_n", &r->rmse.force, 1},
                 {"marker_mm", &r->rmse.marker, 1e-3},
                 {"iterations_mean", &r->tally.iterations_sum, 1}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strlen(known[i].name) == length && strncmp(known[i].name, name, length) == 0) {
            *unit = known[i].unit;
            return known[i].to;
        }
    }
    return NULL;
}

/* One line of an answer. */
static mhe_status take_line(trial_result *r, const char *line, int length, mhe_error *err) {
    const char *space = memchr(line, ' ', (size_t)length);
    const size_t name = space == NULL ? (size_t)length : (size_t)(space - line);
    char *end = NULL;
    const double value = space == NULL ? NAN : strtod(space, &end);
    double unit = 1, *to = place_of(r, line, name, &unit);
    if (space == NULL || end != line + length || end == space) {
        return mhe_fail(err, MHE_E_INPUT, "the program says '%.*s', which is no 'name value'",
                        length, line);
    }
    if (name == 9 && strncmp(line, "converged", 9) == 0) {
        r->tally.n_converged = value > 0.5;
    } else if (to == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "the program says '%.*s': results have no column '%.*s'",
                        length, line, (int)name, line);
    } else {
        *to = value * unit;
    }
    return MHE_OK;
}

static mhe_status take_answer(trial_result *r, const char *text, mhe_error *err) {
    mhe_status status = MHE_OK;
    r->rmse = (mhi_rmse){NAN, NAN, NAN, NAN, NAN, NAN};
    r->tally = (tally){.n_solves = 1, .n_converged = 1, .iterations_sum = NAN};
    for (const char *line = text; *line != '\0' && status == MHE_OK;) {
        const int length = (int)strcspn(line, "\n");
        status = length == 0 ? MHE_OK : take_line(r, line, length, err);
        line += length + (line[length] == '\n');
    }
    if (status == MHE_OK && isnan(r->rmse.q) && isnan(r->rmse.force)) {
        status = mhe_fail(err, MHE_E_INPUT, "the program says neither q_deg nor force_n");
    }
    return status;
}

mhe_status program_run(const study *s, task what, const char *dir, const volatile int32_t *stop,
                       trial_result *result, mhe_error *err) {
    const condition *c = &s->conditions[what.condition];
    mhi_arena arena = {0};
    mhi_text text = {0};
    const char *beside = NULL, *answer = NULL;
    const char **argv = MHI_TAKE(&arena, const char *, 13 + 2 * c->n_set);
    const double begin = measure_seconds();
    study_condition_text(s, c, &text);
    mhe_status status = process_beside("mhe-study", &arena, &beside, err);
    if (status == MHE_OK && (argv == NULL || text.failed)) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        int32_t n = 0;
        argv[n++] = s->keys.program;
        argv[n++] = "--condition";
        argv[n++] = text.data;
        argv[n++] = "--trial";
        argv[n++] = mhi_arena_format(&arena, "%d", (int)what.trial);
        argv[n++] = "--seed";
        argv[n++] = mhi_arena_format(&arena, "%d", (int)study_seed(s, c, what.trial));
        argv[n++] = "--out";
        argv[n++] = dir;
        argv[n++] = "--bin";
        argv[n++] = mhi_arena_format(&arena, "%.*s", (int)(strrchr(beside, '/') - beside), beside);
        for (int32_t i = 0; i < c->n_set; i++) {
            argv[n++] = "--set";
            argv[n++] = c->set[i].text;
        }
        argv[n] = s->keys.config;
        status = arena.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                              : process_read(argv, &arena, &answer, err);
    }
    if (status == MHE_OK) {
        status = take_answer(result, answer, err);
    }
    result->seconds = measure_seconds() - begin;
    mhi_text_free(&text);
    mhi_arena_free(&arena);
    if (status != MHE_OK && *stop) { /* the signal ended the program, too */
        return mhe_fail(err, MHE_E_INTERRUPTED, "interrupted");
    }
    if (status != MHE_OK && status != MHE_E_MEMORY) {
        result->failed = 1;
        result->reason = *err;
        return MHE_OK;
    }
    return status;
}
