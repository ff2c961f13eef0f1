/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"

#include "measure.h"

#include <math.h>
#include <string.h>

#define SAMPLES 100     /* of a layer in each repeat */
#define SHORTEST 20e-6  /* s: a sample is no shorter, so that the clock does not count */
#define CALIBRATION 100 /* calls */

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static void drop_line(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

/* Puts the variant before the message. */
static mhe_status blame(const variant *v, mhe_status status, mhe_error *err) {
    if (err == NULL) {
        return status;
    }
    const mhe_error why = *err;
    return mhe_fail(err, status > 0 ? MHE_E_NUMERIC : status, "%s: %s", v->name, why.text);
}

static bench_spread spread_of(double *values, int32_t n) {
    measure_sort(values, n);
    return (bench_spread){.p50 = measure_percentile(values, n, 0.5),
                          .p95 = measure_percentile(values, n, 0.95),
                          .p99 = measure_percentile(values, n, 0.99),
                          .p999 = measure_percentile(values, n, 0.999),
                          .most = measure_percentile(values, n, 1)};
}

/* `scratch` [n]. */
static bench_ratio ratio_of(const double *values, const double *first, int32_t n, double *scratch) {
    for (int32_t i = 0; i < n; i++) {
        scratch[i] = values[i] / first[i];
    }
    measure_sort(scratch, n);
    return (bench_ratio){measure_percentile(scratch, n, 0), measure_median(scratch, n),
                         measure_percentile(scratch, n, 1)};
}

/* ---- layers ---- */

/* How many calls make a sample; warms up as well. */
static mhe_status calibrate(layers *l, bench_layer *b, mhe_error *err) {
    double seconds = 0;
    mhe_status status = layers_time(l, b->layer, 1, &seconds, err); /* cold */
    const int32_t calls = seconds > SHORTEST * 50 ? 1 : CALIBRATION;
    if (status == MHE_OK) {
        status = layers_time(l, b->layer, calls, &seconds, err);
    }
    b->calls = (int32_t)fmin(fmax(1, ceil(SHORTEST * calls / seconds)), 10000);
    return status;
}

/* `of_group` [n_groups]. */
static mhe_status prepare_layers(bench *b, layers *const *of_group, mhe_error *err) {
    const variants *v = b->setup->variants;
    const int32_t n = SAMPLES * b->setup->repeats;
    for (int32_t job = 0; job < N_LAYERS * v->n; job++) {
        const variant *of = &v->list[job % v->n];
        const int32_t layer = job / v->n;
        if (!of->opens_group || !layers_has(of_group[of->group], layer)) {
            continue;
        }
        bench_layer *new = &b->layers[b->n_layers++];
        *new = (bench_layer){.layer = layer, .rig = &b->runs[job % v->n].rig, .n = n};
        new->samples = MHI_TAKE(&b->arena, double, n);
        if (new->samples == NULL) {
            return no_memory(err);
        }
        mhe_status status = calibrate(of_group[of->group], new, err);
        if (status != MHE_OK) {
            return blame(of, status, err);
        }
    }
    return MHE_OK;
}

/* Sample by sample through all layers and groups: what disturbs one disturbs its neighbours. */
static mhe_status sample_layers(bench *b, layers *const *of_group, mhe_error *err) {
    for (int32_t i = 0; i < SAMPLES * b->setup->repeats; i++) {
        for (int32_t j = 0; j < b->n_layers; j++) {
            bench_layer *l = &b->layers[j];
            const variant *of = l->rig->variant;
            double seconds = 0;
            mhe_status status = layers_time(of_group[of->group], l->layer, l->calls, &seconds, err);
            if (status != MHE_OK) {
                return blame(of, status, err);
            }
            l->samples[i] = seconds / l->calls;
        }
    }
    return MHE_OK;
}

static mhe_status measure_layers(bench *b, mhe_error *err) {
    const variants *v = b->setup->variants;
    layers **of_group = MHI_TAKE(&b->arena, layers *, v->n_groups);
    mhe_status status = of_group == NULL ? no_memory(err) : MHE_OK;
    for (int32_t i = 0; i < v->n && status == MHE_OK; i++) {
        if (v->list[i].opens_group) {
            status = layers_create(&b->runs[i].rig, &of_group[v->list[i].group], err);
        }
    }
    if (status == MHE_OK) {
        status = prepare_layers(b, of_group, err);
    }
    if (status == MHE_OK) {
        status = sample_layers(b, of_group, err);
    }
    for (int32_t g = 0; of_group != NULL && g < v->n_groups; g++) {
        layers_free(of_group[g]);
    }
    return status;
}

/* ---- runs ---- */

static mhe_status prepare_runs(bench *b, mhe_error *err) {
    const variants *v = b->setup->variants;
    const int32_t repeats = b->setup->repeats;
    for (int32_t i = 0; i < v->n; i++) {
        bench_run *run = &b->runs[i];
        const mhe_host *loud = v->list[i].opens_group ? b->setup->host : &b->silent;
        mhe_status status =
            rig_create(&v->list[i], b->setup->estimates, loud, &b->silent, &run->rig, err);
        if (status != MHE_OK) {
            return blame(&v->list[i], status, err);
        }
        int32_t taken = 0;
        for (int32_t part = 0; part < N_PARTS; part++) {
            double *all =
                MHI_TAKE(&b->arena, double, (size_t)repeats *(size_t)run->rig.n_estimates_max);
            run->parts[part].all = all;
            taken += all != NULL;
        }
        run->means = MHI_TAKE(&b->arena, double, repeats);
        run->firsts = MHI_TAKE(&b->arena, double, repeats);
        if (taken < N_PARTS || run->means == NULL || run->firsts == NULL) {
            return no_memory(err);
        }
    }
    return MHE_OK;
}

/* The first estimate of a run, which starts from nothing, is told apart from the others. */
static mhe_status run_once(bench_run *run, int32_t repeat, mhe_error *err) {
    double *parts[N_PARTS], sum = 0;
    int32_t n = 0;
    for (int32_t part = 0; part < N_PARTS; part++) {
        parts[part] = run->parts[part].all + run->n;
    }
    mhe_status status = rig_run(&run->rig, parts, &n, err);
    if (status != MHE_OK) {
        return blame(run->rig.variant, status, err);
    }
    run->firsts[repeat] = parts[PART_FRAME][0];
    const int32_t left_out = n > 1;
    n -= left_out;
    for (int32_t part = 0; part < N_PARTS && left_out; part++) {
        memmove(parts[part], parts[part] + 1, sizeof(double) * (size_t)n);
    }
    for (int32_t i = 0; i < n; i++) {
        sum += parts[PART_FRAME][i];
    }
    run->means[repeat] = sum / n;
    run->n_frames = n; /* in every run */
    run->n += n;
    return MHE_OK;
}

static mhe_status measure_runs(bench *b, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t repeat = 0; repeat < b->setup->repeats; repeat++) {
        for (int32_t i = 0; i < b->setup->variants->n && status == MHE_OK; i++) {
            status = run_once(&b->runs[i], repeat, err);
        }
    }
    return status;
}

/* ---- summing up ---- */

/* `scratch` [n, or n_frames + repeats]. */
static void sum_up_part(const bench_run *run, int32_t repeats, double *scratch, bench_part *part) {
    const int32_t n = run->n_frames;
    double *one = scratch + n; /* [repeats] */
    for (int32_t i = 0; i < repeats; i++) {
        memcpy(scratch, part->all + (ptrdiff_t)i * n, sizeof(double) * (size_t)n);
        const bench_spread of_run = spread_of(scratch, n);
        one[i] = of_run.p999 / of_run.p50;
    }
    measure_sort(one, repeats);
    part->tail = measure_median(one, repeats);
    for (int32_t frame = 0; frame < n; frame++) {
        for (int32_t i = 0; i < repeats; i++) {
            one[i] = part->all[(ptrdiff_t)i * n + frame];
        }
        measure_sort(one, repeats);
        scratch[frame] = measure_median(one, repeats);
    }
    part->by_frame = spread_of(scratch, n);
    memcpy(scratch, part->all, sizeof(double) * (size_t)run->n);
    part->spread = spread_of(scratch, run->n);
}

static int32_t scratch_size(const bench *b) {
    const int32_t repeats = b->setup->repeats;
    int32_t most = SAMPLES * repeats;
    for (int32_t i = 0; i < b->setup->variants->n; i++) {
        const bench_run *run = &b->runs[i];
        most = run->n + run->n_frames + repeats > most ? run->n + run->n_frames + repeats : most;
    }
    return most;
}

/* Back to front, since the first of each sort is what the others are compared with and sorting
 * would part the pairs. */
static mhe_status sum_up(bench *b, mhe_error *err) {
    const int32_t repeats = b->setup->repeats, n = SAMPLES * repeats;
    double *scratch = MHI_TAKE(&b->arena, double, scratch_size(b));
    if (scratch == NULL) {
        return no_memory(err);
    }
    for (int32_t i = b->n_layers; i-- > 0;) {
        bench_layer *l = &b->layers[i];
        int32_t first = i;
        while (first > 0 && b->layers[first - 1].layer == l->layer) {
            first--;
        }
        l->ratio = ratio_of(l->samples, b->layers[first].samples, n, scratch);
        l->spread = spread_of(l->samples, n);
    }
    for (int32_t i = b->setup->variants->n; i-- > 0;) {
        bench_run *run = &b->runs[i];
        run->ratio = ratio_of(run->means, b->runs[0].means, repeats, scratch);
        for (int32_t part = 0; part < N_PARTS; part++) {
            sum_up_part(run, repeats, scratch, &run->parts[part]);
        }
        measure_sort(run->firsts, repeats);
        run->first = measure_median(run->firsts, repeats);
        measure_sort(run->means, repeats);
        run->rate = 1 / measure_median(run->means, repeats);
    }
    return MHE_OK;
}

mhe_status bench_measure(const bench_setup *setup, bench *b, mhe_error *err) {
    const double begin = measure_seconds();
    *b = (bench){.setup = setup};
    b->silent = *setup->host;
    b->silent.log = drop_line;
    mhe_status status = prepare_runs(b, err);
    if (status == MHE_OK && !setup->no_layers) {
        status = measure_layers(b, err);
    }
    if (status == MHE_OK) {
        status = measure_runs(b, err);
    }
    if (status == MHE_OK) {
        status = sum_up(b, err);
    }
    b->elapsed = measure_seconds() - begin;
    return status;
}

void bench_free(bench *b) {
    for (int32_t i = 0; i < b->setup->variants->n; i++) {
        rig_free(&b->runs[i].rig);
    }
    mhi_arena_free(&b->arena);
}
