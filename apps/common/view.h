/* SPDX-License-Identifier: Apache-2.0 */
/* view.h: a folder of results as one page that needs no other file and no network: the page of live
 * runs (page/), with the results in it. */
#ifndef VIEW_H
#define VIEW_H

#include "base/text.h"

#include <mhe/config.h>

typedef struct view_setup {
    const char *dir;       /* results of mhe-run, or tables of mhe.sink.files ("live_q.sto") */
    const char *title;     /* NULL: the folder's name */
    const char *summary;   /* plain lines; NULL: what summary.json says */
    const char *reference; /* .sto with columns q_*, a_*, F_*: the known truth; NULL: none */
    mhe_config *config;    /* for the stick figure; NULL: without */
} view_setup;

/* Appends the page. MHE_E_INPUT: there are no results in the folder. [cold] */
mhe_status view_compose(const view_setup *setup, mhi_text *out, mhe_error *err);

#endif
