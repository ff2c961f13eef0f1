/* SPDX-License-Identifier: Apache-2.0 */
/* findings.h: what makes a recording, a model or an estimate doubtful, and what helps. */
#ifndef MHI_FINDINGS_H
#define MHI_FINDINGS_H

#include <mhe/host.h>

#define MHI_FINDING_NOTE 0     /* to be known; results are as good as without it */
#define MHI_FINDING_DOUBTFUL 1 /* angles or forces may be wrong by more than they should */
#define MHI_FINDING_USELESS 2  /* they are wrong */

typedef struct mhi_finding {
    int32_t weight;     /* MHI_FINDING_* */
    char *text;         /* one line, with file:line where there is one */
    const char *remedy; /* what to do; static; "": nothing is known */
    char *advice;       /* the same made for this finding; NULL: `remedy` holds */
} mhi_finding;

/* {0} is empty. */
typedef struct mhi_findings {
    mhi_finding *all;
    int32_t n, capacity;
    int32_t failed; /* memory was out: not all are there */
} mhi_findings;

/* `remedy` is kept, not copied. [cold] */
MHE_PRINTF(4, 5)
void mhi_findings_add(mhi_findings *findings, int32_t weight, const char *remedy,
                      const char *format, ...);
/* A remedy of its own for the last one added. */
MHE_PRINTF(2, 3) void mhi_findings_advise(mhi_findings *findings, const char *format, ...);
void mhi_findings_free(mhi_findings *findings);

const char *mhi_finding_remedy(const mhi_finding *finding); /* never NULL */
/* The largest weight; MHI_FINDING_NOTE of none. */
int32_t mhi_findings_weight(const mhi_findings *findings);
/* "yes", "doubtful", "no": is an estimate with findings of this weight usable? */
const char *mhi_usable(int32_t weight);
/* Findings from `first` on as warnings: "text; remedy". [cold] */
void mhi_findings_tell(const mhi_findings *findings, int32_t first, const mhe_host *host);

#endif
