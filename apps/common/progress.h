/* SPDX-License-Identifier: Apache-2.0 */
/* progress.h: a progress bar with the time left, on a terminal only. */
#ifndef PROGRESS_H
#define PROGRESS_H

#include <mhe/abi.h>

typedef struct progress {
    int32_t enabled, shown;
    int32_t total;
    int32_t before; /* done before this run: they took none of its time */
    double begin, drawn;
} progress;

/* `quiet` or no terminal on stderr: nothing is shown. */
void progress_start(progress *p, int32_t total, int32_t before, int quiet);
/* 1 where a new picture is due: at most ten times a second, and at the end. */
int32_t progress_due(const progress *p, int32_t done);
/* Draws the bar, with words behind it. */
MHE_PRINTF(3, 4) void progress_update(progress *p, int32_t done, const char *format, ...);
void progress_end(progress *p);
double progress_elapsed(const progress *p); /* s */

#endif
