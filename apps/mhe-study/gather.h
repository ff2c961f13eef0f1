/* SPDX-License-Identifier: Apache-2.0 */
/* gather.h: from rows to tables: results.csv (the same to the byte for the same study, however it
 * was run) and timing.csv (what varies). */
#ifndef GATHER_H
#define GATHER_H

#include "rows.h"

/* Writes both into `dir`, one line per row, by condition and trial. */
mhe_status gather(const study *s, const rows *r, const char *dir, mhe_error *err);
/* What the rows come to, in lines for people. */
void gather_tell(const study *s, const rows *r, mhi_text *out);

#endif
