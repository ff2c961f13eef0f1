/* SPDX-License-Identifier: Apache-2.0 */
/* test_testkit.c: the conformance checks let a good cost pass and find each planted fault. */
#include <mhe/testkit.h>

#include "support.h"

#include <string.h>

#ifdef COUNT_ALLOCATIONS
#include "allocations.h"

static uint64_t allocations(void *data) {
    (void)data;
    return mhi_allocations();
}
#define COUNTER allocations
#else
#define COUNTER NULL
#endif

typedef struct found {
    const char *check; /* that is to fail */
    int hits, others;
    char other[256];
} found;

static void collect(void *data, int32_t outcome, const char *plugin, const char *check,
                    const char *detail) {
    found *f = data;
    (void)plugin;
    if (outcome != MHE_CHECK_FAILED) {
        return;
    }
    if (f->check != NULL && strstr(check, f->check) != NULL) {
        f->hits++;
    } else {
        f->others++;
        (void)snprintf(f->other, sizeof f->other, "%s: %s", check, detail);
    }
}

static found run(const char *name, const char *check) {
    found f = {.check = check};
    mhe_testkit kit = {.size = sizeof kit, .data = &f, .report = collect, .allocations = COUNTER};
    char file[4096];
    (void)snprintf(file, sizeof file, "%s/%s.so", PLUGIN_DIR, name);
    assert_int_equal(mhe_testkit_run(&kit, file, NULL), MHE_OK);
    assert_int_equal(kit.failed, f.hits + f.others);
    assert_true(kit.passed > 0);
    assert_int_equal(kit.skipped, 0);
    return f;
}

/* The fault is found by the check that is meant for it, and by no other. */
static void found_by(const char *name, const char *check) {
    const found f = run(name, check);
    if (f.hits == 0 || f.others > 0) {
        fail_msg("%s: %d failures of '%s', others: %s", name, f.hits, check, f.other);
    }
}

static void a_good_cost_passes(void **state) {
    (void)state;
    const found f = run("good", NULL);
    if (f.others > 0) {
        fail_msg("%s", f.other);
    }
}

static void each_fault_is_found_by_its_check(void **state) {
    (void)state;
    found_by("layout", "layout fits the problem");
    found_by("behind_output", "writes its outputs alone");
    found_by("behind_scratch", "writes its outputs alone");
    found_by("swallows_nan", "never gives a finite residual");
    found_by("jacobian", "jacobian against differences");
#ifdef COUNT_ALLOCATIONS
    found_by("allocates", "no allocation");
    found_by("exports", "exports mhe_plugin_entry alone");
#endif
}

static void faults_that_spoil_other_checks_are_found_too(void **state) {
    (void)state;
    assert_true(run("unwritten", "outputs finite and complete").hits > 0);
    assert_true(run("input", "writes its outputs alone").hits > 0);
    assert_true(run("memory", "same bits").hits > 0);
}

static void a_refused_file_is_a_failed_check(void **state) {
    (void)state;
    found f = {.check = "loads"};
    mhe_error err = {0};
    mhe_testkit kit = {.size = sizeof kit, .data = &f, .report = collect};
    assert_int_equal(mhe_testkit_run(&kit, "/no/such/plugin.so", &err), MHE_E_PLUGIN);
    assert_int_equal(f.hits, 1);
    assert_int_equal(kit.failed, 1);
    assert_string_equal(err.text, "/no/such/plugin.so: cannot be read: No such file or directory");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_cost_passes),
        cmocka_unit_test(each_fault_is_found_by_its_check),
        cmocka_unit_test(faults_that_spoil_other_checks_are_found_too),
        cmocka_unit_test(a_refused_file_is_a_failed_check),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
