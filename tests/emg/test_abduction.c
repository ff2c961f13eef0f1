/* SPDX-License-Identifier: Apache-2.0 */
/* The real recording: raw EMG becomes plausible EMG of its 16 muscles on the markers' frames. */
#include "estimator/create.h"
#include "estimator/recording.h"
#include "io/model_file.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char alignment[512];
static int n_warnings;
static char data[512]; /* the recording's folder */

static void listen(const mhe_host *host, int32_t level, const char *text) {
    (void)host;
    n_warnings += level == MHE_LOG_WARNING;
    if (level == MHE_LOG_INFO && strncmp(text, "EMG ", 4) == 0) {
        (void)snprintf(alignment, sizeof alignment, "%s", text);
    }
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

/* Mean EMG of a muscle over frames. */
static double mean_of(const mhi_recording *r, const mhe_description *d, const char *muscle,
                      int32_t from, int32_t to) {
    int32_t i = 0, n = 0;
    double sum = 0;
    while (i < d->n_muscles && strcmp(d->muscles[i].name, muscle) != 0) {
        i++;
    }
    assert_in_range(i, 0, d->n_muscles - 1);
    for (int32_t k = from; k < to; k++) {
        const double value = r->emg[(ptrdiff_t)k * d->n_muscles + i];
        sum += isnan(value) ? 0 : value;
        n += !isnan(value);
    }
    return n == 0 ? NAN : sum / n;
}

static void emg_follows_the_arm(void **state) {
    (void)state;
    static const mhe_host host = {.size = sizeof host, .log = listen, .service = no_service};
    char folder[256], command[1500], config[300], link[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(link, sizeof link, "%s/abduction", folder);
    (void)snprintf(config, sizeof config, "%s/abduction.yaml", folder);
    assert_int_equal(symlink(data, link), 0);
    (void)snprintf(command, sizeof command, "cp %s/models/abduction/abduction.yaml %s",
                   MHE_TEST_SOURCE_DIR, config);
    assert_int_equal(system(command), 0);
    mhi_registry *registry = NULL;
    mhi_run *run = NULL;
    mhe_description *d = NULL;
    mhi_recording *r = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_registry_create(&host, &registry, &err), MHE_OK);
    assert_int_equal(mhi_run_read(config, NULL, 0, registry, &run, &err), MHE_OK);
    assert_int_equal(mhi_estimator_read_model(run, &host, &d, &err), MHE_OK);
    n_warnings = 0;
    assert_int_equal(mhi_recording_read(run, d, &host, &r, &err), MHE_OK);
    assert_string_equal(err.text, "");
    assert_int_equal(n_warnings, 1); /* four markers of the trunk are none of the model's */
    assert_non_null(
        strstr(alignment, "EMG 2000 Hz, markers 100 Hz, grid 100 Hz, offset 0 ms; 10 channels"));
    assert_int_equal(r->n_frames, 700);
    assert_int_equal(r->n_emg_found, 16);
    int32_t tracked = 0;
    for (int32_t i = 0; i < d->n_muscles; i++) {
        double most = 0;
        for (int32_t k = 20; k < 700; k++) { /* the filters are full after 0.14 s */
            const double value = r->emg[(ptrdiff_t)k * d->n_muscles + i];
            most = fmax(most, value);
            assert_true(isnan(value) == isnan(r->emg[(ptrdiff_t)20 * d->n_muscles + i]));
        }
        tracked += most > 0;
        assert_true(most <= 1);
    }
    assert_int_equal(tracked, 16);
    /* the arm hangs in the first second and is up between 3 and 4 s: the deltoid lifts it */
    const char *const lifting[] = {"DELTmed", "DELTant", "TRPsup"};
    for (int i = 0; i < 3; i++) {
        const double hanging = mean_of(r, d, lifting[i], 20, 80);
        const double up = mean_of(r, d, lifting[i], 300, 400);
        print_message("%s: %.3f hanging, %.3f up\n", lifting[i], hanging, up);
        assert_true(up > 2 * hanging && up > 0.05 && up < 1);
    }
    mhi_recording_free(r);
    mhi_description_free(d);
    mhi_run_free(run);
    mhi_registry_free(registry);
    (void)unlink(config);
    (void)unlink(link);
    (void)rmdir(folder);
}

int main(void) {
    if (test_data_path(data, sizeof data, "abduction") == NULL) {
        (void)puts("the recording is absent: skipped");
        return TEST_SKIPPED;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(emg_follows_the_arm)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
