/* SPDX-License-Identifier: Apache-2.0 */
/* track.h: a whole run: recording in, result files out. */
#ifndef TRACK_H
#define TRACK_H

#include <mhe/config.h>

typedef struct track_setup {
    const char *path; /* of the config */
    mhe_config *config;
    const mhe_host *host;
    const char *out; /* folder */
    int quiet;
    int check_only; /* open everything, estimate nothing */
    int realtime;   /* frames come by the clock */
} track_setup;

/* MHE_E_INTERRUPTED: Ctrl-C or SIGTERM; the files hold what was estimated until then. On any other
 * failure no file appears. */
mhe_status track(const track_setup *setup, mhe_error *err);

#endif
