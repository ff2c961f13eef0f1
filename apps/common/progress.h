/* SPDX-License-Identifier: Apache-2.0 */
/* progress.h: a line on the terminal that moves while a run goes on. */
#ifndef PROGRESS_H
#define PROGRESS_H

#include <stdint.h>

typedef struct progress {
    int enabled;
    int32_t total;
    double begin, drawn; /* s */
    int shown;
} progress;

/* Enabled only where stderr is a terminal and `quiet` is 0. */
void progress_start(progress *p, int32_t total, int quiet);
/* `done` of total steps, `solves` so far of which `converged` did; draws at most ten times a
 * second. */
void progress_update(progress *p, int32_t done, int32_t solves, int32_t converged);
void progress_end(progress *p); /* clears the line */

#endif
