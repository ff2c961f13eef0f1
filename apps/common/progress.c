/* SPDX-License-Identifier: Apache-2.0 */
#include "progress.h"

#include "measure.h"

#include <stdio.h>
#include <unistd.h>

#define BAR 30

void progress_start(progress *p, int32_t total, int quiet) {
    *p = (progress){
        .enabled = !quiet && isatty(STDERR_FILENO), .total = total, .begin = measure_seconds()};
}

void progress_update(progress *p, int32_t done, int32_t solves, int32_t converged) {
    const double time = measure_seconds();
    if (!p->enabled || (time - p->drawn < 0.1 && done < p->total) || done == 0) {
        return;
    }
    p->drawn = time;
    p->shown = 1;
    const double elapsed = time - p->begin;
    const double left = elapsed * (p->total - done) / done;
    const int filled = (int)((int64_t)BAR * done / p->total);
    char bar[BAR + 1];
    for (int i = 0; i < BAR; i++) {
        bar[i] = i < filled ? '#' : '.';
    }
    bar[BAR] = '\0';
    (void)fprintf(stderr, "\r[%s] %3d %%  %.0f s left  %.1f solves/s  %.1f %% converged ", bar,
                  (int)(100.0 * done / p->total), left, elapsed > 0 ? solves / elapsed : 0.0,
                  solves == 0 ? 100.0 : 100.0 * converged / solves);
    (void)fflush(stderr);
}

void progress_end(progress *p) {
    if (p->shown) {
        (void)fprintf(stderr, "\r\033[K");
        (void)fflush(stderr);
    }
}
