/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_search.c: finds the stream that a predicate names. */
#include "source_lsl.h"

#include <string.h>

#define MOST_FOUND 16
#define FORGET 5.0 /* s after which a sender that answers no more is forgotten */
#define SETTLE 0.6 /* s: another of the same name would have answered by then */

void lsl_end_search(lsl_source *source, lsl_stream *s) {
    if (s->search != NULL) {
        source->lsl.destroy_continuous_resolver(s->search);
        s->search = NULL;
    }
    s->found = 0;
}

static mhe_status judge(const lsl_library *l, lsl_stream *s, lsl_streaminfo *found, int32_t n,
                        mhe_error *err) {
    if (n < 1) {
        s->found = 0;
        return mhe_fail(err, MHE_RETRY, "no stream with %s", s->predicate);
    }
    if (n > 1) {
        return mhe_fail(
            err, MHE_RETRY,
            "%d streams with %s ('%.60s' of '%.40s', '%.60s' of '%.40s'): name one, as in "
            "name='%.60s', or source_id='...'",
            n, s->predicate, l->get_name(found[0]), l->get_hostname(found[0]),
            l->get_name(found[1]), l->get_hostname(found[1]), l->get_name(found[0]));
    }
    if (s->found == 0) {
        s->found = lsl_now();
    }
    return lsl_now() - s->found >= SETTLE
               ? MHE_OK
               : mhe_fail(err, MHE_RETRY, "stream '%.60s' is being opened", l->get_name(found[0]));
}

mhe_status lsl_look(lsl_source *source, lsl_stream *s, lsl_streaminfo *info, mhe_error *err) {
    const lsl_library *l = &source->lsl;
    lsl_streaminfo found[MOST_FOUND];
    *info = NULL;
    if (s->search == NULL) {
        s->found = 0;
        s->search = l->create_continuous_resolver_bypred(s->predicate, FORGET);
    }
    if (s->search == NULL) {
        return mhe_fail(err, MHE_RETRY, "liblsl cannot look for %s", s->predicate);
    }
    const int32_t n = l->resolver_results(s->search, found, MOST_FOUND);
    const mhe_status status = judge(l, s, found, n, err);
    for (int32_t i = status == MHE_OK ? 1 : 0; i < n; i++) {
        l->destroy_streaminfo(found[i]);
    }
    *info = status == MHE_OK ? found[0] : NULL;
    return status;
}
