/* SPDX-License-Identifier: Apache-2.0 */
/* The paper's EMG noise: moments over 1 000 seeds against the formulas, and what a seed means. */
#include "rig.h"

#include "base/pi.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#define SEEDS 1000
#define N 801
#define BASE 20.0 /* so far above 0 that nothing is clipped */

static const int harmonics[] = {1, 4, 7, 10, 13, 16};

static double signal_at(int k) {
    double sum = 0;
    for (int i = 1; i <= 20; i++) { /* every harmonic in both phases, some negative */
        sum += 0.05 / i *
               ((i % 3 == 0 ? -1 : 1) * cos(2 * MHI_PI * i * k / N) +
                0.4 * sin(2 * MHI_PI * i * k / N));
    }
    return sum;
}

/* X_i by the definition. */
static void transform(const double *x, int i, double *re, double *im) {
    *re = *im = 0;
    for (int k = 0; k < N; k++) {
        const double angle = 2 * MHI_PI * fmod((double)i * k, N) / N;
        *re += x[k] * cos(angle);
        *im -= x[k] * sin(angle);
    }
}

/* m and s of the paper for Re X_i = c. */
static void formula(int i, double c, double level, double *m, double *s) {
    if (i == 4) {
        *m = c * level / i;
        *s = fabs(0.2 * c * level);
    } else if (i % 2 == 0) {
        *m = 2 * c * level / i;
        *s = fabs(0.2 * c * level);
    } else {
        *m = 2 * c * level / i;
        *s = fabs(5 * c * level);
    }
}

static void moments_at_level(double level) {
    static double r[6][SEEDS];
    double x[N];
    for (int seed = 0; seed < SEEDS; seed++) {
        for (int k = 0; k < N; k++) {
            x[k] = BASE + signal_at(k);
        }
        mhi_noise_harmonics(x, N, 1, level, seed, 5);
        for (int k = 0; k < N; k++) {
            assert_true(x[k] > 0); /* not clipped */
            x[k] -= BASE + signal_at(k);
        }
        for (int h = 0; h < 6; h++) {
            double im = 0;
            transform(x, harmonics[h], &r[h][seed], &im);
            assert_true(fabs(im) < 1e-9);
        }
    }
    for (int h = 0; h < 6; h++) {
        double clean[N], c = 0, im = 0, m = 0, s = 0, mean = 0, square = 0, coupling = 0;
        for (int k = 0; k < N; k++) {
            clean[k] = signal_at(k);
        }
        transform(clean, harmonics[h], &c, &im);
        formula(harmonics[h], c, level, &m, &s);
        for (int seed = 0; seed < SEEDS; seed++) {
            mean += r[h][seed] / SEEDS;
        }
        for (int seed = 0; seed < SEEDS; seed++) {
            square += pow(r[h][seed] - mean, 2) / (SEEDS - 1);
            coupling += (r[h][seed] - m) / s * (r[(h + 1) % 6][seed]) / SEEDS;
        }
        char what[64];
        (void)snprintf(what, sizeof what, "level %g, harmonic %d, mean", level, harmonics[h]);
        assert_within_5(mean, m, s / sqrt(SEEDS), what);
        (void)snprintf(what, sizeof what, "level %g, harmonic %d, spread", level, harmonics[h]);
        assert_within_5(sqrt(square), s, s / sqrt(2.0 * (SEEDS - 1)), what);
        double next_c = 0, next_m = 0, next_s = 0; /* of r_h and r_(h+1): no correlation */
        transform(clean, harmonics[(h + 1) % 6], &next_c, &im);
        formula(harmonics[(h + 1) % 6], next_c, level, &next_m, &next_s);
        assert_within_5(coupling, 0, hypot(next_m, next_s) / sqrt(SEEDS), "correlation");
    }
}

static void moments(void **state) {
    (void)state;
    moments_at_level(1);
    moments_at_level(1.5);
    moments_at_level(2);
}

/* 1 000 seeds cannot tell the mean of the odd harmonics, s / m = 17.5 and 32.5 for 7 and 13, from
 * none; 100 000 of a short trial can (17 and 9 standard errors). */
static void means_over_many_seeds(void **state) {
    (void)state;
    enum { SHORT = 33, MANY = 100000 };
    double wave[6][SHORT], clean[SHORT], c[6] = {0}, mean[6] = {0};
    for (int k = 0; k < SHORT; k++) {
        clean[k] = BASE;
        for (int h = 0; h < 6; h++) {
            wave[h][k] = cos(2 * MHI_PI * harmonics[h] * k / SHORT);
            clean[k] += (h % 2 == 0 ? 0.02 : -0.02) * wave[h][k];
        }
    }
    for (int h = 0; h < 6; h++) {
        for (int k = 0; k < SHORT; k++) {
            c[h] += clean[k] * wave[h][k];
        }
    }
    for (int seed = 0; seed < MANY; seed++) {
        double x[SHORT];
        memcpy(x, clean, sizeof x);
        mhi_noise_harmonics(x, SHORT, 1, 1, seed, 0);
        for (int k = 0; k < SHORT; k++) {
            assert_true(x[k] > 0);
            for (int h = 0; h < 6; h++) {
                mean[h] += (x[k] - clean[k]) * wave[h][k] / MANY;
            }
        }
    }
    for (int h = 0; h < 6; h++) {
        double m = 0, s = 0;
        char what[32];
        formula(harmonics[h], c[h], 1, &m, &s);
        (void)snprintf(what, sizeof what, "harmonic %d, mean", harmonics[h]);
        assert_within_5(mean[h], m, s / sqrt(MANY), what);
    }
}

static void other_harmonics_are_untouched(void **state) {
    (void)state;
    double clean[N], noisy[N];
    for (int k = 0; k < N; k++) {
        clean[k] = noisy[k] = BASE + signal_at(k);
    }
    mhi_noise_harmonics(noisy, N, 1, 2, 11, 0);
    for (int i = 0; i <= 20; i++) {
        double re[2], im[2];
        transform(clean, i, &re[0], &im[0]);
        transform(noisy, i, &re[1], &im[1]);
        int changes = 0;
        for (int h = 0; h < 6; h++) {
            changes |= harmonics[h] == i;
        }
        assert_true(changes ? fabs(re[1] - re[0]) > 1e-3 : fabs(re[1] - re[0]) < 1e-9);
        assert_true(fabs(im[1] - im[0]) < 1e-9);
    }
}

/* A constant changes none of the harmonics: what is clipped is known from what is not. */
static void negative_values_become_zero(void **state) {
    (void)state;
    double low[N], high[N];
    int clipped = 0;
    for (int k = 0; k < N; k++) {
        low[k] = 0.1 + signal_at(k);
        high[k] = BASE + 0.1 + signal_at(k);
    }
    mhi_noise_harmonics(low, N, 1, 2, 3, 0);
    mhi_noise_harmonics(high, N, 1, 2, 3, 0);
    for (int k = 0; k < N; k++) {
        const double unclipped = high[k] - BASE;
        clipped += unclipped < -1e-9;
        assert_true(low[k] >= 0);
        assert_true(fabs(low[k] - fmax(unclipped, 0)) < 1e-9);
    }
    assert_in_range(clipped, 10, N - 10); /* the case is there */
}

static void level_0_is_the_truth(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_noise noise = {.seed = 5};
    mhi_record emg;
    rig_emg(&rig, &noise, &emg);
    assert_int_equal(emg.n_samples, RIG_FRAMES);
    assert_int_equal(emg.n_channels, rig.model->n_muscles);
    assert_memory_equal(emg.time, rig.truth->time, sizeof(double) * RIG_FRAMES);
    assert_memory_equal(emg.values, rig.truth->reference.excitation,
                        sizeof(double) * (size_t)(RIG_FRAMES * emg.n_channels));
    mhi_record_free(&emg);
    rig_close(&rig);
}

static int same(const mhi_record *a, const mhi_record *b) {
    return a->n_samples == b->n_samples &&
           memcmp(a->values, b->values,
                  sizeof(double) * (size_t)a->n_samples * (size_t)a->n_channels) == 0;
}

static void a_seed_is_a_trial(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    mhi_noise noise = {.seed = 1, .emg.level = 1};
    mhi_record first, again, other;
    rig_emg(&rig, &noise, &first);
    noise.markers.sd = 0.01; /* of no concern to the EMG */
    rig_emg(&rig, &noise, &again);
    assert_true(same(&first, &again));
    for (noise.seed = 2; noise.seed < 50; noise.seed++) {
        rig_emg(&rig, &noise, &other);
        assert_false(same(&first, &other));
        mhi_record_free(&other);
    }
    mhi_record_free(&first);
    mhi_record_free(&again);
    rig_close(&rig);
}

/* The gain's deviates are others than the level's: what the level adds is the gain times what it
 * adds without. */
static void options_do_not_disturb_each_other(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    for (int i = 0; i < RIG_FRAMES * rig.model->n_muscles; i++) {
        rig.truth->reference.excitation[i] += BASE;
    }
    mhi_noise noise = {.seed = 9, .emg.level = 1};
    mhi_record level, gain, both;
    rig_emg(&rig, &noise, &level);
    noise.emg.gain_sd = 0.1;
    rig_emg(&rig, &noise, &both);
    noise.emg.level = 0;
    rig_emg(&rig, &noise, &gain);
    for (int i = 0; i < RIG_FRAMES * level.n_channels; i++) {
        const double factor = gain.values[i] / rig.truth->reference.excitation[i];
        assert_true(fabs(both.values[i] - factor * level.values[i]) < 1e-9);
    }
    mhi_record_free(&level);
    mhi_record_free(&gain);
    mhi_record_free(&both);
    rig_close(&rig);
}

typedef struct job {
    const noise_rig *rig;
    mhi_record emg;
    mhe_status status;
} job;

static void *work(void *data) {
    job *j = data;
    const mhi_noise noise = {.seed = 77, .emg = {.level = 1.5, .gain_sd = 0.1}};
    j->status = mhi_noise_emg(&noise, j->rig->truth, j->rig->model, &j->emg, NULL);
    return NULL;
}

static void same_bits_on_eight_threads(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    job jobs[9];
    pthread_t threads[8];
    for (int i = 0; i < 9; i++) {
        jobs[i] = (job){.rig = &rig};
    }
    (void)work(&jobs[8]);
    for (int i = 0; i < 8; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, work, &jobs[i]), 0);
    }
    for (int i = 0; i < 8; i++) {
        assert_int_equal(pthread_join(threads[i], NULL), 0);
        assert_int_equal(jobs[i].status, MHE_OK);
        assert_true(same(&jobs[i].emg, &jobs[8].emg));
        mhi_record_free(&jobs[i].emg);
    }
    mhi_record_free(&jobs[8].emg);
    rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(moments),
                                       cmocka_unit_test(means_over_many_seeds),
                                       cmocka_unit_test(other_harmonics_are_untouched),
                                       cmocka_unit_test(negative_values_become_zero),
                                       cmocka_unit_test(level_0_is_the_truth),
                                       cmocka_unit_test(a_seed_is_a_trial),
                                       cmocka_unit_test(options_do_not_disturb_each_other),
                                       cmocka_unit_test(same_bits_on_eight_threads)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
