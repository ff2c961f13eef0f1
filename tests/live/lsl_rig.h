/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_rig.h: liblsl itself as the other side: senders and receivers on loopback. */
#ifndef TEST_LSL_RIG_H
#define TEST_LSL_RIG_H

#include "../../plugins/lsl_library.h"

/* What senders of a test need beside what the plugins take. */
typedef struct lsl_rig {
    lsl_library lsl;
    int32_t (*push_int16)(lsl_outlet outlet, const int16_t *data, double stamp, int32_t through);
    int32_t (*push_text)(lsl_outlet outlet, const char **data, double stamp, int32_t through);
    int32_t (*have_consumers)(lsl_outlet outlet);
} lsl_rig;

/* Loads the library that the plugins will find, told to keep to loopback and to this process and
 * its children (a session of its own). `folder`: where its configuration may be written. 0: there
 * is no liblsl. */
int lsl_rig_open(const char *folder, lsl_rig *rig);

typedef struct lsl_channel {
    const char *label, *unit, *type;
} lsl_channel;

lsl_outlet lsl_rig_send(const lsl_rig *rig, const char *name, const char *type, int32_t format,
                        double rate, const lsl_channel *channels, int32_t n);

double lsl_rig_now(void); /* s of CLOCK_MONOTONIC */
void lsl_rig_rest(double seconds);

#endif
