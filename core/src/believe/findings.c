/* SPDX-License-Identifier: Apache-2.0 */
#include "believe/findings.h"

#include "base/text.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define LONGEST 1024

void mhi_findings_add(mhi_findings *f, int32_t weight, const char *remedy, const char *format,
                      ...) {
    if (f->n == f->capacity) {
        const int32_t capacity = f->capacity == 0 ? 16 : 2 * f->capacity;
        mhi_finding *grown = realloc(f->all, sizeof *grown * (size_t)capacity);
        if (grown == NULL) {
            f->failed = 1;
            return;
        }
        f->all = grown;
        f->capacity = capacity;
    }
    char text[LONGEST];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    f->all[f->n] = (mhi_finding){.weight = weight, .remedy = remedy, .text = strdup(text)};
    f->failed |= f->all[f->n].text == NULL;
    f->n += f->all[f->n].text != NULL;
}

void mhi_findings_advise(mhi_findings *f, const char *format, ...) {
    char text[LONGEST];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (f->n > 0) {
        free(f->all[f->n - 1].advice);
        f->all[f->n - 1].advice = strdup(text);
    }
}

void mhi_findings_free(mhi_findings *f) {
    for (int32_t i = 0; i < f->n; i++) {
        free(f->all[i].text);
        free(f->all[i].advice);
    }
    free(f->all);
    *f = (mhi_findings){0};
}

const char *mhi_finding_remedy(const mhi_finding *finding) {
    return finding->advice != NULL ? finding->advice : finding->remedy;
}

int32_t mhi_findings_weight(const mhi_findings *f) {
    int32_t weight = f->failed ? MHI_FINDING_DOUBTFUL : MHI_FINDING_NOTE;
    for (int32_t i = 0; i < f->n; i++) {
        weight = f->all[i].weight > weight ? f->all[i].weight : weight;
    }
    return weight;
}

const char *mhi_usable(int32_t weight) {
    return weight == MHI_FINDING_NOTE ? "yes" : weight == MHI_FINDING_DOUBTFUL ? "doubtful" : "no";
}

void mhi_findings_tell(const mhi_findings *f, int32_t first, const mhe_host *host) {
    for (int32_t i = first; i < f->n; i++) {
        const char *remedy = mhi_finding_remedy(&f->all[i]);
        mhi_text line = {0};
        mhi_text_add(&line, "%s%s%s", f->all[i].text, *remedy == '\0' ? "" : "; ", remedy);
        if (!line.failed) {
            host->log(host, MHE_LOG_WARNING, line.data);
        }
        mhi_text_free(&line);
    }
}
