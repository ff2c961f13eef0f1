/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/looks.h"

#include "base/clock.h"

#include <string.h>

#define LAST (MHE_GRANT_LOOKS - 1) /* a run without an end: it is odd */

static void keep(mhi_looks *l, int32_t *late) {
    if (*late != (l->run & 1) && l->run < LAST) {
        l->run++;
    }
    *late = l->run & 1;
    l->grant.looks[l->run] += l->grant.looks[l->run] < INT32_MAX;
}

/* The next of what was kept; where a replay asks more often (with another config), the last answer
 * holds. */
static int32_t repeat(mhi_looks *l) {
    while (l->run < LAST && l->in_run >= l->grant.looks[l->run]) {
        int32_t more = 0;
        for (int32_t k = l->run + 1; k <= LAST; k++) {
            more |= l->grant.looks[k] > 0;
        }
        if (!more) {
            break;
        }
        l->run++;
        l->in_run = 0;
    }
    l->in_run++;
    return l->run & 1;
}

/* Where an evaluation was broken off since the last look: here, or when this was recorded. */
static void keep_refusal(mhi_looks *l, mhi_work *work) {
    if (!l->obeys && l->grant.refused < 0 && mhi_work_is_refused(work)) {
        l->grant.refused = l->n;
    }
    if (l->obeys && l->grant.refused >= 0 && l->n >= l->grant.refused) {
        mhi_work_refuse(work);
    }
}

void mhi_looks_begin(mhi_looks *l, const mhe_grant *grant, int32_t by_clock, mhi_work *work) {
    *l = (mhi_looks){.obeys = grant != NULL};
    if (grant != NULL) {
        l->grant = *grant;
    } else {
        l->grant.by_clock = by_clock;
        l->grant.refused = -1;
    }
    keep_refusal(l, work);
}

int32_t mhi_looks_late(mhi_looks *l, double deadline, double seconds, mhi_work *work) {
    int32_t late;
    if (l->obeys) {
        late = repeat(l);
    } else {
        late = mhi_seconds() + seconds >= deadline;
        keep_refusal(l, work);
        keep(l, &late);
    }
    l->n++;
    if (l->obeys) {
        keep_refusal(l, work);
    }
    return late;
}
