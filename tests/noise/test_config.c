/* SPDX-License-Identifier: Apache-2.0 */
/* The file: the shipped example, what is written back, and what is refused with its line. */
#include "noise/config.h"
#include "use.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[256], path[300];
static mhi_registry *registry;

static int make_folder(void **state) {
    (void)state;
    if (test_folder(folder, sizeof folder) == NULL) {
        return 1;
    }
    (void)snprintf(path, sizeof path, "%s/noise.yaml", folder);
    return mhi_registry_create(test_host(), &registry, NULL);
}

static int remove_folder(void **state) {
    (void)state;
    mhi_registry_free(registry);
    (void)unlink(path);
    return rmdir(folder);
}

static void write_file(const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static void read_file(const char *file, const char *const *set, int32_t n_set,
                      mhi_noise_config *config) {
    mhe_error err = {0};
    if (mhi_noise_config_read(file, set, n_set, registry, config, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void shipped_example(void **state) {
    (void)state;
    if (test_plugin("mhe.model.simbody", MHE_MODEL_IFACE) == NULL) {
        skip();
    }
    static const char *const set[] = {"noise.markers.rate=120"};
    mhi_noise_config config;
    read_file(MHE_TEST_SOURCE_DIR "/models/arm19/noise.yaml", set, 1, &config);
    assert_int_equal(config.noise.seed, 1);
    assert_true(config.noise.markers.sd == 0.005);
    assert_true(config.noise.markers.clock.rate == 120);
    assert_true(config.noise.markers.drift_time == 1);
    assert_true(config.noise.emg.level == 1.5);
    assert_true(config.noise.emg.clock.rate == 0);
    assert_int_equal(config.output.levels.n, 3);
    assert_string_equal(config.reference, MHE_TEST_SOURCE_DIR "/models/arm19/demo_reference.sto");
    assert_string_equal(config.run->name, "noise");
    mhi_noise_config_free(&config);
}

static const char everything[] = "model: {file: arm.osim, unsupported: warn}\n"
                                 "reference: /data/truth.sto\n"
                                 "noise:\n"
                                 "  seed: 7\n"
                                 "  markers:\n"
                                 "    {sd: 0.002, white_sd: 5e-4, drift_sd: 0.001, drift_time: 2,\n"
                                 "     gaps: {DELT: '1..2'}, segment_gaps: {Arm: '3..4, 5..6'},\n"
                                 "     rate: 120, latency: 0.01, clock_error: -1e-4}\n"
                                 "  emg:\n"
                                 "    {level: 1.5, gain_sd: 0.1, crosstalk: {BRA: BRD 0.2},\n"
                                 "     failures: {BRD: 1..2}, failed_electrode: zero, rate: 1000,\n"
                                 "     latency: -0.02, clock_error: 1e-3}\n"
                                 "  raw_emg:\n"
                                 "    {electrodes: {Biceps: 'BRA 0.5, BRD 0.25'}, mvc: [3e-4],\n"
                                 "     band_low: 30, band_high: 400, amplifier_sd: 2e-6}\n"
                                 "output: {picture: false, levels: [1, 2]}\n";

static void written_reads_back_the_same(void **state) {
    (void)state;
    if (test_plugin("mhe.model.simbody", MHE_MODEL_IFACE) == NULL) {
        skip();
    }
    mhi_noise_config config;
    mhi_text first = {0}, second = {0};
    write_file(everything);
    read_file(path, NULL, 0, &config);
    assert_string_equal(config.noise.markers.segment_gaps.values[0], "3..4, 5..6");
    assert_int_equal(config.noise.emg.failed_electrode, MHI_FAILED_ZERO);
    assert_true(config.noise.markers.clock.clock_error == -1e-4);
    assert_true(config.noise.emg.clock.latency == -0.02);
    assert_string_equal(config.noise.raw_emg.electrodes.values[0], "BRA 0.5, BRD 0.25");
    assert_true(config.noise.raw_emg.clock.rate == 2000);
    assert_true(config.noise.raw_emg.mvc.values[0] == 3e-4);
    mhi_noise_config_write(&config, &first);
    mhi_noise_config_free(&config);
    write_file(first.data);
    read_file(path, NULL, 0, &config);
    mhi_noise_config_write(&config, &second);
    mhi_noise_config_free(&config);
    assert_string_equal(first.data, second.data);
    assert_non_null(strstr(first.data, "\n  emg:\n    level: 1.5\n"));
    mhi_text_free(&first);
    mhi_text_free(&second);
}

static void refused(void **state) {
    (void)state;
    if (test_plugin("mhe.model.simbody", MHE_MODEL_IFACE) == NULL) {
        skip();
    }
    static const struct {
        const char *text, *reason;
    } cases[] = {
        {"reference: r.sto\n", "model"},
        {"model: {file: a.osim}\n", "the key 'reference' is missing"},
        {"model: {file: a.osim}\nreference: r\nnois: {}\n", ":3: unknown key 'nois' (did you mean"},
        {"model: {file: a.osim}\nreference: r\nnoise:\n  marker: {}\n",
         ":4: noise: unknown key 'marker' (did you mean 'markers'?)"},
        {"model: {file: a.osim}\nreference: r\nnoise:\n  emg: {levle: 1}\n",
         ":4: noise.emg: unknown key 'levle' (did you mean 'level'?)"},
        {"model: {file: a.osim}\nreference: r\nnoise: {markers: {sd: 5}}\n", "sd"},
        {"model: {file: a.osim}\nreference: r\nnoise: {seed: -1}\n", "seed"},
        {"model: {file: a.osim}\nreference: r\nnoise: {seed: 1.5}\n", "seed"},
        {"model: {file: a.osim}\nreference: r\nnoise: 3\n", "noise: must be a mapping"},
        {"model: {file: a.osim}\nreference: r\nnoise: [1, 2]\n", "noise: must be a mapping"},
        {"model: {file: a.osim}\nreference: r\nnoise: {emg: [1]}\n", "noise.emg: must be a"},
        {"model: {file: a.osim}\nreference: r\noutput: {levels: [1, 2, 3, 4, 5]}\n",
         "output: 'levels' has 5 values; 4 can be shown"},
        {"model: {file: a.osim, plugin: mhe.model.simbod}\nreference: r\n", "did you mean"},
        {"- a\n- b\n", "is a mapping of sections"},
        {"", "model"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        mhi_noise_config config;
        mhe_error err = {0};
        write_file(cases[i].text);
        mhe_status status = mhi_noise_config_read(path, NULL, 0, registry, &config, &err);
        mhi_noise_config_free(&config);
        if (status >= 0 || strstr(err.text, cases[i].reason) == NULL ||
            strncmp(err.text, path, strlen(path)) != 0) {
            fail_msg("case %zu: '%s' is not in '%s'", i, cases[i].reason, err.text);
        }
    }
}

static void every_key_is_described(void **state) {
    (void)state;
    static const char *const keys[] = {"reference",   "seed",      "sd",          "white_sd",
                                       "drift_sd",    "gaps",      "latency",     "level",
                                       "clock_error", "crosstalk", "failures",    "levels",
                                       "electrodes",  "band_low",  "amplifier_sd"};
    mhi_text text = {0};
    mhi_noise_config_describe(&text);
    assert_non_null(text.data);
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        char line[32];
        (void)snprintf(line, sizeof line, "\n  %s: ", keys[i]);
        assert_non_null(strstr(text.data, line));
    }
    mhi_text_free(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shipped_example), cmocka_unit_test(written_reads_back_the_same),
        cmocka_unit_test(refused), cmocka_unit_test(every_key_is_described)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
