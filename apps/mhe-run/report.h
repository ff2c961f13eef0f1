/* SPDX-License-Identifier: Apache-2.0 */
/* report.h: a run on one page, report.html, that needs no other file and no network. */
#ifndef REPORT_H
#define REPORT_H

#include <mhe/config.h>

/* Writes dir/report.html from the result files in dir (complete): `summary` (plain lines), the
 * posture with its muscles, and pictures of joint angles, EMG against activation, forces, markers
 * and solve times, beside the truth in `reference` (a .sto with columns q_*, a_*, F_*; NULL: not
 * known), with bands where they were estimated. [cold] */
mhe_status report_write(const char *dir, mhe_config *config, const char *summary,
                        const char *reference, mhe_error *err);

#endif
