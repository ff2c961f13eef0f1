/* SPDX-License-Identifier: Apache-2.0 */
/* unmet.c: where a solve ends without a motion, its last iterate still tells what stood in the way:
 * the state whose next value the dynamics miss by most, and the blocks that lean on their bounds.
 */
#include "estimator/estimator_private.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define LEANS 0.3    /* of a block's entries at bounds: worth a word */
#define TOUCHES 1e-3 /* of a usual size from a bound */
#define TELLS 1e-2   /* usual sizes that a gap is worth a word from on, as in solve.c */

mhe_status mhi_unmet_create(mhi_unmet *u, int32_t n_x, mhi_arena *arena, mhe_error *err) {
    *u = (mhi_unmet){.next = MHI_TAKE(arena, double, n_x)};
    return u->next == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

/* Appends to what stands in u->now, as far as there is room: a frame allocates nothing. */
MHE_PRINTF(2, 3)
static void add(mhi_unmet *u, const char *format, ...) {
    const size_t at = strlen(u->now);
    va_list args;
    va_start(args, format);
    (void)vsnprintf(u->now + at, sizeof u->now - at, format, args);
    va_end(args);
}

/* The largest jump between intervals, in usual sizes; its state and size. */
typedef struct gap {
    const mhe_block *block;
    int32_t entry;
    double size, share;
} gap;

static gap find_gap(mhe_estimator *e) {
    const mhe_layout *layout = mhi_ocp_problem(e->ocp)->layout;
    const mhi_window *w = &e->window;
    const mhe_stage_values out = {.size = sizeof out, .x_next = e->unmet.next};
    gap most = {0};
    for (int32_t k = 0; k < w->n; k++) {
        if (mhi_ocp_expand(e->ocp, k, mhi_row(w->solution.x, k, w->n_x),
                           mhi_row(w->solution.u, k, e->n_u), &out, NULL) != MHE_OK) {
            continue;
        }
        const double *next = mhi_row(w->solution.x, k + 1, w->n_x);
        for (int32_t b = 0; b < layout->n_blocks; b++) {
            const mhe_block *block = mhe_layout_at(layout, b);
            for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE; i++) {
                const double size = fabs(e->unmet.next[block->first + i] - next[block->first + i]);
                if (size / block->scale[i] > most.share) {
                    most = (gap){block, i, size, size / block->scale[i]};
                }
            }
        }
    }
    return most;
}

/* Share of a block's entries at their bounds; *fixed: all have one value. */
static double leaning(mhe_estimator *e, const mhe_block *block, int32_t *fixed) {
    const int32_t is_state = block->role == MHE_ROLE_STATE;
    int32_t n = 0, at = 0;
    *fixed = 1;
    for (int32_t k = is_state; k < e->window.n + is_state; k++) { /* x_0 is given */
        const double *lower = is_state ? mhi_ocp_x_lower(e->ocp, k) : mhi_ocp_u_lower(e->ocp, k);
        const double *upper = is_state ? mhi_ocp_x_upper(e->ocp, k) : mhi_ocp_u_upper(e->ocp, k);
        const double *w = is_state ? mhi_row(e->window.solution.x, k, e->window.n_x)
                                   : mhi_row(e->window.solution.u, k, e->n_u);
        for (int32_t i = 0; i < block->count; i++) {
            const int32_t j = block->first + i;
            const double near = TOUCHES * block->scale[i];
            *fixed &= lower[j] == upper[j];
            at += w[j] <= lower[j] + near || w[j] >= upper[j] - near;
            n++;
        }
    }
    return n > 0 ? (double)at / n : 0;
}

static void describe(mhe_estimator *e) {
    const mhe_layout *layout = mhi_ocp_problem(e->ocp)->layout;
    const gap most = find_gap(e);
    if (most.share > TELLS) {
        const char *unit = most.block->units[most.entry];
        const int32_t none = strcmp(unit, "1") == 0;
        add(&e->unmet, "; %s of %s jumps by %.2g%s%s", most.block->name,
            most.block->entry_names[most.entry], most.size, none ? "" : " ", none ? "" : unit);
    }
    int32_t n = 0;
    for (int32_t b = 0; b < layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(layout, b);
        int32_t fixed = 0;
        if (block->count == 0 ||
            (block->role != MHE_ROLE_STATE && block->role != MHE_ROLE_CONTROL)) {
            continue;
        }
        const double share = leaning(e, block, &fixed);
        if (fixed) {
            add(&e->unmet, "%s %s (all of one value)", n++ == 0 ? "; at their bounds:" : ",",
                block->name);
        } else if (share > LEANS) {
            add(&e->unmet, "%s %s (%.0f %%)", n++ == 0 ? "; at their bounds:" : ",", block->name,
                100 * share);
        }
    }
}

void mhi_unmet_solved(mhe_estimator *e, int32_t failed) {
    mhi_unmet *u = &e->unmet;
    u->length = failed ? u->length + 1 : 0;
    if (u->length == (mhi_pace_by_clock(e) ? e->window.n : 1)) { /* time is short by the clock */
        u->now[0] = '\0';
        add(u, "from %.4g s on no motion of the model was found within its bounds",
            e->window.times[0]);
        describe(e);
    }
    if (u->length > u->most) {
        u->most = u->length;
        memcpy(u->of_most, u->now, sizeof u->now);
    }
}

const char *mhi_estimator_unmet(const mhe_estimator *e) {
    return e->unmet.of_most;
}
