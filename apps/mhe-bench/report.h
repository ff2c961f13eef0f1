/* SPDX-License-Identifier: Apache-2.0 */
/* report.h: what was measured, as a table for the terminal, as bench.json and as frames.csv. */
#ifndef REPORT_H
#define REPORT_H

#include "bench.h"

void report_table(const bench *b, mhi_text *out);
/* `config` is the config file's path. */
mhe_status report_json(const bench *b, const char *config, mhi_text *out, mhe_error *err);

/* Every estimate of every run: a table of numbers with a heading. */
void report_frames(const bench *b, mhi_text *out);

#endif
