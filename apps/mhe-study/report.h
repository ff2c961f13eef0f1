/* SPDX-License-Identifier: Apache-2.0 */
/* report.h: mhe-study report: statistics, figures and a page of a results folder. */
#ifndef REPORT_H
#define REPORT_H

#include "arguments.h"

#include <mhe/host.h>

/* Gathers the rows, writes what only the core can compute (the example of EMG noise), and hands the
 * folder to the scripts in share/mhe/study, which need Python with pandas, statsmodels, scipy and
 * matplotlib. */
mhe_status report_make(const arguments *a, const mhe_host *host, mhe_error *err);

#endif
