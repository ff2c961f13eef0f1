/* SPDX-License-Identifier: Apache-2.0 */
/* interrupt.h: Ctrl-C and SIGTERM end a run within a moment, whatever it is busy with.
 *
 * The first asks: the solve in work ends at its next evaluation, and what was estimated until then
 * is written. A plugin that never comes back is left after INTERRUPT_GRACE seconds, or at once by a
 * second signal that is no mere echo of the first: the program then ends with status 1 and without
 * a file. */
#ifndef INTERRUPT_H
#define INTERRUPT_H

#include <mhe/estimator.h>
#include <mhe/outbox.h>

#define INTERRUPT_GRACE 2 /* s */

/* From here on signals ask, and stop the estimator. Both are lent; the outbox's files do not change
 * until interrupt_settle, and after it the estimator is left alone. */
void interrupt_begin(const mhe_outbox *outbox, mhe_estimator *estimator);
int32_t interrupt_asked(void); /* to end */
/* The frames are done, the files are being written: this is brief and is not broken off, but by a
 * second signal. */
void interrupt_settle(void);
/* Signals do what they did before interrupt_begin, unless one has come: then the program is to end
 * of itself. */
void interrupt_end(void);

#endif
