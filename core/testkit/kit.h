/* SPDX-License-Identifier: Apache-2.0 */
/* kit.h: what the checks of all interfaces share. */
#ifndef MHI_KIT_H
#define MHI_KIT_H

#include "base/arena.h"

#include <mhe/description.h>
#include <mhe/model.h>
#include <mhe/plugin.h>
#include <mhe/testkit.h>

/* One plugin under test. */
typedef struct mhi_kit {
    mhe_testkit *public_kit;
    mhi_arena arena; /* all memory of the checks */
    mhe_host host;
    const mhe_plugin *plugin;
    void *config; /* filled with the defaults */
} mhi_kit;

void mhi_kit_pass(mhi_kit *kit, const char *check);
MHE_PRINTF(3, 4) void mhi_kit_fail(mhi_kit *kit, const char *check, const char *format, ...);
MHE_PRINTF(3, 4) void mhi_kit_skip(mhi_kit *kit, const char *check, const char *format, ...);
MHE_PRINTF(3, 4) void mhi_kit_note(mhi_kit *kit, const char *check, const char *format, ...);
/* Pass, or fail with "<value>, limit <limit>"; NaN fails. Returns whether it passed. */
int mhi_kit_limit(mhi_kit *kit, const char *check, double value, double limit);

/* Zeroed arrays; an empty arena ends the process: a test has no better answer. */
void *mhi_kit_take(mhi_kit *kit, size_t bytes);
#define MHI_KIT_TAKE(kit, T, n) ((T *)mhi_kit_take((kit), sizeof(T) * (size_t)(n)))

/* The same numbers on every machine, in [lower, upper]. */
double mhi_kit_random(uint64_t *seed, double lower, double upper);
/* Sets an option of the filled config where the plugin has it as a number, cut to its range. */
void mhi_kit_set_number(mhi_kit *kit, const char *key, double value);

/* ---- a [hot] function seen as blocks of numbers in, blocks of numbers out ---- */

#define MHI_MAX_BLOCKS 12
#define MHI_WORKERS 8

typedef struct mhi_block {
    int32_t n;          /* doubles */
    int32_t zeroed;     /* outputs: handed over zeroed; else filled with NaN */
    int32_t may_be_nan; /* outputs: not checked to be finite */
} mhi_block;

typedef struct mhi_probe {
    const char *name;
    int32_t n_in, n_out;
    mhi_block in[MHI_MAX_BLOCKS], out[MHI_MAX_BLOCKS];
    uint32_t scratch_bytes;    /* handed to each call, with canaries behind */
    void *data;                /* shared by all threads */
    void *worker[MHI_WORKERS]; /* each thread's own (contexts); may be NULL */
    mhe_status (*call)(void *data, void *worker, void *scratch, const double *const *in,
                       double *const *out, mhe_error *err);
} mhi_probe;

/* Status, finite and complete outputs, inputs untouched, canaries, same bits twice and on
 * MHI_WORKERS threads, allocations; at the inputs `in` [n_in][in[i].n]. One check a property. */
void mhi_probe_check(mhi_kit *kit, const mhi_probe *probe, const double *const *in);

/* Jacobian of out block `o` with respect to in block `i` at `in`, against central differences of
 * fourth order with a step study: `jacobian` [out[o].n x in[i].n]. */
void mhi_probe_jacobian(mhi_kit *kit, const mhi_probe *probe, const double *const *in, int32_t i,
                        int32_t o, const double *jacobian, const char *check);

/* Same, for any function. Returns the largest error relative to max(row of J, 1e-4 |y|), or NaN
 * where f fails. */
typedef int (*mhi_function)(void *data, const double *x, double *y);
double mhi_jacobian_error(mhi_kit *kit, mhi_function f, void *data, const double *x, int32_t n_x,
                          int32_t n_y, const double *jacobian);

/* Exact derivatives: central differences of fourth order leave about 1e-10. */
#define MHI_JACOBIAN_LIMIT 1e-6

/* ---- a description ---- */

#define MHI_MADE_UP_Q 3
#define MHI_MADE_UP_BODIES 3
#define MHI_MADE_UP_MARKERS 2
#define MHI_MADE_UP_MUSCLES 2
#define MHI_MADE_UP_PATHS 4 /* two muscles, a spring, a ligament */

const mhe_description *mhi_kit_description(void);

/* ---- the checks, one file an interface ---- */

void mhi_check_exports(mhi_kit *kit, const char *file);
void mhi_check_cost(mhi_kit *kit);
void mhi_check_muscle(mhi_kit *kit);
void mhi_check_force(mhi_kit *kit);
void mhi_check_model(mhi_kit *kit);
/* Loads at the point in = {q, v} of the made-up skeleton, where its bodies are and move as said. */
void mhi_check_loads(mhi_kit *kit, const mhe_model_ops *ops, void *const *contexts,
                     const double *body, const double *body_q, const double *const *in, int turn);
void mhi_check_integrator(mhi_kit *kit);
void mhi_check_solver(mhi_kit *kit);
void mhi_check_parameters(mhi_kit *kit); /* of a solver */
void mhi_check_source(mhi_kit *kit);
void mhi_check_sink(mhi_kit *kit);

#endif
