/* SPDX-License-Identifier: Apache-2.0 */
#include "progress.h"

#include "measure.h"

#include <stdarg.h>
#include <stdio.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define BAR 30        /* signs at most */
#define BESIDE_BAR 52 /* signs that the words take: the bar gives way to them */

void progress_start(progress *p, int32_t total, int32_t before, int quiet) {
    *p = (progress){.enabled = !quiet && isatty(STDERR_FILENO),
                    .total = total,
                    .before = before,
                    .begin = measure_seconds()};
}

double progress_elapsed(const progress *p) {
    return measure_seconds() - p->begin;
}

int32_t progress_due(const progress *p, int32_t done) {
    return p->enabled && done > p->before &&
           (measure_seconds() - p->drawn >= 0.1 || done == p->total);
}

/* A longer line would wrap and stay on the screen. */
static int terminal_width(void) {
    struct winsize size;
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

/* "45 s", "12 min", "3 h 05 min" */
static void write_time(double seconds, char *out, size_t size) {
    const int minutes = (int)(seconds / 60 + 0.5);
    if (seconds < 100) {
        (void)snprintf(out, size, "%.0f s", seconds);
    } else if (minutes < 100) {
        (void)snprintf(out, size, "%d min", minutes);
    } else {
        (void)snprintf(out, size, "%d h %02d min", minutes / 60, minutes % 60);
    }
}

void progress_update(progress *p, int32_t done, const char *format, ...) {
    if (!progress_due(p, done)) {
        return;
    }
    p->drawn = measure_seconds();
    p->shown = 1;
    char bar[BAR + 1], left[32], words[160];
    const int width = terminal_width(), room = width - 1 - BESIDE_BAR;
    const int length = room > BAR ? BAR : room > 0 ? room : 0;
    const int filled = (int)((int64_t)length * done / p->total);
    for (int i = 0; i < length; i++) {
        bar[i] = i < filled ? '#' : '.';
    }
    bar[length] = '\0';
    write_time(progress_elapsed(p) * (p->total - done) / (done - p->before), left, sizeof left);
    va_list args;
    va_start(args, format);
    (void)vsnprintf(words, sizeof words, format, args);
    va_end(args);
    char line[BAR + 256];
    (void)snprintf(line, sizeof line, "%s%s%s%3d %%  %s left  %s", length > 0 ? "[" : "", bar,
                   length > 0 ? "] " : "", (int)(100.0 * done / p->total), left, words);
    (void)fprintf(stderr, "\r\033[K%.*s", width - 1, line);
    (void)fflush(stderr);
}

void progress_end(progress *p) {
    if (p->shown) {
        (void)fprintf(stderr, "\r\033[K");
        (void)fflush(stderr);
    }
}
