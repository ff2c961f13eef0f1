/* SPDX-License-Identifier: Apache-2.0 */
#include "control/solution_cache.h"

#include "base/digest.h"
#include "base/number.h"
#include "io/slurp.h"
#include <mhe/outbox.h>

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HEAD "solution %016" PRIx64 "\n" /* digest of what follows: the key, then numbers */

typedef struct span {
    double *values;
    size_t n;
} span;

static size_t spans(const mhi_trajectory *t, span out[2]) {
    out[0] = (span){t->x, (size_t)(t->n + 1) * (size_t)t->n_x};
    out[1] = (span){t->u, (size_t)t->n * (size_t)t->n_u};
    return 2;
}

static void file_name(const mhi_text *key, char out[32]) {
    (void)snprintf(out, 32, "%016" PRIx64 ".solution", mhi_digest(key->data, key->length));
}

/* ---- read ---- */

static int32_t take(const char **at, double *value) {
    char *end = NULL;
    *value = strtod(*at, &end);
    const int32_t good = end != *at && isfinite(*value);
    *at = end;
    return good;
}

static int32_t read_numbers(const char *at, mhi_trajectory *t, mhe_solve_info *info) {
    double iterations = 0;
    span parts[2];
    int32_t good = take(&at, &iterations) && iterations >= 0 && iterations <= INT32_MAX &&
                   take(&at, &info->objective) && take(&at, &info->kkt_residual) &&
                   take(&at, &info->primal_residual);
    for (size_t p = 0, n = spans(t, parts); p < n && good; p++) {
        for (size_t i = 0; i < parts[p].n && good; i++) {
            good = take(&at, &parts[p].values[i]);
        }
    }
    info->iterations = good ? (int32_t)iterations : 0;
    info->outcome = MHE_SOLVE_CONVERGED;
    return good && strcmp(at, "\n") == 0;
}

/* What follows the head of a whole file, or NULL. */
static const char *whole(const char *text, size_t length) {
    char head[64];
    const char *line = memchr(text, '\n', length);
    if (line == NULL) {
        return NULL;
    }
    const char *body = line + 1;
    (void)snprintf(head, sizeof head, HEAD, mhi_digest(body, length - (size_t)(body - text)));
    return strncmp(text, head, strlen(head)) == 0 ? body : NULL;
}

int32_t mhi_solution_read(const char *dir, const mhi_text *key, mhi_trajectory *t,
                          mhe_solve_info *info) {
    mhi_text path = {0};
    char name[32], *text = NULL;
    size_t length = 0;
    mhe_error ignored = {0};
    int32_t found = 0;
    file_name(key, name);
    mhi_text_add(&path, "%s/%s", dir, name);
    if (!path.failed && mhi_slurp(path.data, &text, &length, &ignored) == MHE_OK) {
        const char *body = whole(text, length);
        if (body != NULL && strncmp(body, key->data, key->length) == 0) {
            const mhi_c_locale saved = mhi_c_locale_begin();
            found = read_numbers(body + key->length, t, info);
            mhi_c_locale_end(saved);
        }
    }
    free(text);
    mhi_text_free(&path);
    return found;
}

/* ---- write ---- */

static void write_numbers(const mhi_trajectory *t, const mhe_solve_info *info, mhi_text *out) {
    span parts[2];
    mhi_text_add(out, "%d %a %a %a", (int)info->iterations, info->objective, info->kkt_residual,
                 info->primal_residual);
    for (size_t p = 0, n = spans(t, parts); p < n; p++) {
        for (size_t i = 0; i < parts[p].n; i++) {
            mhi_text_add(out, " %a", parts[p].values[i]);
        }
    }
    mhi_text_add(out, "\n");
}

mhe_status mhi_solution_write(const char *dir, const mhi_text *key, const mhi_trajectory *t,
                              const mhe_solve_info *info, mhe_error *err) {
    mhi_text body = {0}, file = {0};
    mhe_outbox *outbox = NULL;
    char name[32];
    file_name(key, name);
    const mhi_c_locale saved = mhi_c_locale_begin();
    mhi_text_add(&body, "%s", key->data);
    write_numbers(t, info, &body);
    mhi_c_locale_end(saved);
    if (!body.failed) {
        mhi_text_add(&file, HEAD "%s", mhi_digest(body.data, body.length), body.data);
    }
    mhe_status status = body.failed || file.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                   : mhe_outbox_open(dir, &outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, name, file.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&body);
    mhi_text_free(&file);
    return status;
}
