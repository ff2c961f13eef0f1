/* SPDX-License-Identifier: Apache-2.0 */
/* report.h: a run on one page, report.html, that needs no other file and no network. */
#ifndef REPORT_H
#define REPORT_H

#include "base/text.h"

/* Writes dir/report.html from the result files in dir (complete): `summary` (plain lines) and
 * pictures of joint angles, EMG against activation, forces, markers and solve times, beside the
 * truth in `reference` (a .sto with columns q_*, a_*, F_*; NULL: not known), and bands where
 * `with_bands`. [cold] */
mhe_status report_write(const char *dir, const char *name, const char *summary,
                        const char *reference, int with_bands, mhe_error *err);

#endif
