/* SPDX-License-Identifier: Apache-2.0 */
/* probe.c: what every [hot] function must keep to, whatever it computes. */
#include "kit.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#define CANARY 0xa5
#define CANARY_BYTES 64
#define THREAD_CALLS 25

/* Everything that one call touches. Each block has canaries behind it. */
typedef struct workspace {
    const double *in[MHI_MAX_BLOCKS];
    double *out[MHI_MAX_BLOCKS];
    void *scratch;
} workspace;

static void *take_guarded(mhi_kit *kit, size_t bytes) {
    char *memory = mhi_kit_take(kit, bytes + CANARY_BYTES);
    memset(memory + bytes, CANARY, CANARY_BYTES);
    return memory;
}

static int canary_alive(const void *memory, size_t bytes) {
    const unsigned char *behind = (const unsigned char *)memory + bytes;
    for (int i = 0; i < CANARY_BYTES; i++) {
        if (behind[i] != CANARY) {
            return 0;
        }
    }
    return 1;
}

static size_t bytes_of(const mhi_block *block) {
    return sizeof(double) * (size_t)block->n;
}

static workspace take_workspace(mhi_kit *kit, const mhi_probe *probe, const double *const *in) {
    workspace w = {0};
    for (int32_t i = 0; i < probe->n_in; i++) {
        double *copy = take_guarded(kit, bytes_of(&probe->in[i]));
        memcpy(copy, in[i], bytes_of(&probe->in[i]));
        w.in[i] = copy;
    }
    for (int32_t i = 0; i < probe->n_out; i++) {
        w.out[i] = take_guarded(kit, bytes_of(&probe->out[i]));
    }
    w.scratch = take_guarded(kit, probe->scratch_bytes);
    return w;
}

static mhe_status call_once(const mhi_probe *probe, const workspace *w, int32_t worker,
                            mhe_error *err) {
    for (int32_t i = 0; i < probe->n_out; i++) {
        for (int32_t k = 0; k < probe->out[i].n; k++) {
            w->out[i][k] = probe->out[i].zeroed ? 0.0 : NAN;
        }
    }
    return probe->call(probe->data, probe->worker[worker], w->scratch, w->in, w->out, err);
}

static int same_outputs(const mhi_probe *probe, const workspace *a, const workspace *b) {
    for (int32_t i = 0; i < probe->n_out; i++) {
        if (memcmp(a->out[i], b->out[i], bytes_of(&probe->out[i])) != 0) {
            return 0;
        }
    }
    return 1;
}

/* ---- properties of one call ---- */

static void check_outputs(mhi_kit *kit, const mhi_probe *probe, const workspace *w,
                          const char *check) {
    for (int32_t i = 0; i < probe->n_out; i++) {
        for (int32_t k = 0; k < probe->out[i].n && !probe->out[i].may_be_nan; k++) {
            if (!isfinite(w->out[i][k])) {
                mhi_kit_fail(kit, check, "entry %d of output %d is %g or was not written", (int)k,
                             (int)i, w->out[i][k]);
                return;
            }
        }
    }
    mhi_kit_pass(kit, check);
}

static void check_memory(mhi_kit *kit, const mhi_probe *probe, const workspace *w,
                         const double *const *in, const char *check) {
    for (int32_t i = 0; i < probe->n_in; i++) {
        if (memcmp(w->in[i], in[i], bytes_of(&probe->in[i])) != 0) {
            mhi_kit_fail(kit, check, "input %d was changed", (int)i);
            return;
        }
        if (!canary_alive(w->in[i], bytes_of(&probe->in[i]))) {
            mhi_kit_fail(kit, check, "wrote behind input %d", (int)i);
            return;
        }
    }
    for (int32_t i = 0; i < probe->n_out; i++) {
        if (!canary_alive(w->out[i], bytes_of(&probe->out[i]))) {
            mhi_kit_fail(kit, check, "wrote behind output %d", (int)i);
            return;
        }
    }
    if (!canary_alive(w->scratch, probe->scratch_bytes)) {
        mhi_kit_fail(kit, check, "wrote behind its scratch memory");
        return;
    }
    mhi_kit_pass(kit, check);
}

static void check_allocations(mhi_kit *kit, const mhi_probe *probe, const workspace *w,
                              const char *check) {
    const mhe_testkit *k = kit->public_kit;
    if (k->allocations == NULL) {
        return;
    }
    const uint64_t before = k->allocations(k->data);
    (void)call_once(probe, w, 0, NULL);
    const uint64_t n = k->allocations(k->data) - before;
    if ((kit->plugin->flags & MHE_FLAG_HOT_ALLOCATES) != 0) {
        mhi_kit_note(kit, check, "%llu allocations in one call", (unsigned long long)n);
    } else if (n > 0) {
        mhi_kit_fail(kit, check, "%llu allocations in one call", (unsigned long long)n);
    } else {
        mhi_kit_pass(kit, check);
    }
}

/* ---- threads ---- */

typedef struct thread_job {
    pthread_t thread;
    const mhi_probe *probe;
    const workspace *expected;
    workspace own;
    int32_t worker;
    int differs;
} thread_job;

static void *run_job(void *data) {
    thread_job *job = data;
    for (int i = 0; i < THREAD_CALLS && !job->differs; i++) {
        job->differs = call_once(job->probe, &job->own, job->worker, NULL) != MHE_OK ||
                       !same_outputs(job->probe, &job->own, job->expected);
    }
    return NULL;
}

static void check_threads(mhi_kit *kit, const mhi_probe *probe, const double *const *in,
                          const workspace *expected, const char *check) {
    thread_job jobs[MHI_WORKERS];
    int started = 0, differs = 0;
    for (int i = 0; i < MHI_WORKERS; i++) {
        jobs[i] = (thread_job){.probe = probe, .expected = expected, .worker = i};
        jobs[i].own = take_workspace(kit, probe, in);
    }
    while (started < MHI_WORKERS &&
           pthread_create(&jobs[started].thread, NULL, run_job, &jobs[started]) == 0) {
        started++;
    }
    for (int i = 0; i < started; i++) {
        (void)pthread_join(jobs[i].thread, NULL);
        differs += jobs[i].differs;
    }
    if (differs > 0) {
        mhi_kit_fail(kit, check, "%d of %d threads got another result", differs, started);
    } else if (started < MHI_WORKERS) {
        mhi_kit_skip(kit, check, "threads could not be started");
    } else {
        mhi_kit_pass(kit, check);
    }
}

/* ---- all of them ---- */

static const char *named(mhi_kit *kit, const mhi_probe *probe, const char *property) {
    char *text = mhi_arena_format(&kit->arena, "%s: %s", probe->name, property);
    return text != NULL ? text : property;
}

void mhi_probe_check(mhi_kit *kit, const mhi_probe *probe, const double *const *in) {
    mhe_error err = {0};
    const workspace first = take_workspace(kit, probe, in);
    const workspace second = take_workspace(kit, probe, in);
    mhe_status status = call_once(probe, &first, 0, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, named(kit, probe, "works"), "status %d: %s", (int)status, err.text);
        return;
    }
    check_outputs(kit, probe, &first, named(kit, probe, "outputs finite and complete"));
    check_memory(kit, probe, &first, in, named(kit, probe, "writes its outputs alone"));
    const char *twice = named(kit, probe, "same bits twice");
    if (call_once(probe, &second, 0, &err) == MHE_OK && same_outputs(probe, &first, &second)) {
        mhi_kit_pass(kit, twice);
    } else {
        mhi_kit_fail(kit, twice, "a second call gave another result");
    }
    check_threads(kit, probe, in, &first, named(kit, probe, "same bits on 8 threads"));
    check_allocations(kit, probe, &second, named(kit, probe, "no allocation"));
}
