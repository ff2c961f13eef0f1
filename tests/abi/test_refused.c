/* SPDX-License-Identifier: Apache-2.0 */
/* test_refused.c: every bad file is refused with its own reason; the good one beside them is found.
 */
#include "plugin/registry.h"

#include <mhe/cost.h>

#include "support.h"

#include <stdlib.h>
#include <string.h>

typedef struct refusal {
    const char *file, *reason;
} refusal;

/* In the order of the folder (by name). */
static const refusal expected[] = {
    {"abi_major.so", "built for ABI 1.2, this is ABI 0.2"},
    {"abi_minor.so", "built for ABI 0.3, this is ABI 0.2"},
    {"create_alone.so", "plugin 'test.cost.abi': one of create() and destroy() is NULL, not both"},
    {"default_out_of_range.so",
     "plugin 'test.cost.abi': option 'gain': the default is out of range"},
    {"duplicate_id.so", "two plugins of the library have the id 'test.cost.abi'"},
    {"duplicate_key.so", "plugin 'test.cost.abi': option 'gain': the key occurs twice"},
    {"empty.so", "not a shared object (no ELF header)"},
    {"library_size.so", "the library table has a wrong size (12 bytes)"},
    {"magic.so", "wrong magic number 0x4d484532 (not a plugin table)"},
    {"malformed_id.so", "a plugin has the malformed id 'Not An Id'"},
    {"no_entry.so", "not a plugin (no symbol mhe_plugin_entry)"},
    {"no_id.so", "a plugin has no id"},
    {"no_option_table.so", "plugin 'test.cost.abi' claims 1 options and has no table"},
    {"no_plugins.so", "the library holds no plugin"},
    {"no_version.so", "plugin 'test.cost.abi' has no version"},
    {"not_elf.so", "not a shared object (no ELF header)"},
    {"null_function.so",
     "plugin 'test.cost.abi': the required function residual() of mhe.cost/2 is NULL"},
    {"null_library.so", "mhe_plugin_entry() returns NULL"},
    {"null_ops.so", "plugin 'test.cost.abi' has no function table"},
    {"null_plugin.so", "an entry of the library table is NULL"},
    {"ops_size.so", "plugin 'test.cost.abi': the function table has a wrong size (2 bytes)"},
    {"option_size.so", "plugin 'test.cost.abi': an option has a wrong size (16 bytes)"},
    {"past_size.so",
     "plugin 'test.cost.abi': the required function residual() of mhe.cost/2 lies past its size"},
    {"plugin_size.so", "a plugin's descriptor has a wrong size (8 bytes)"},
    {"throws.so", "mhe_plugin_entry() threw a C++ exception (std::runtime_error)"},
    {"truncated.so", "the file is truncated"},
    {"truncated_header.so", "the file is truncated"},
    {"unknown_interface.so", "plugin 'test.cost.abi' has the unknown interface 'mhe.cost/99'"},
    {"unresolved.so", "cannot be linked: undefined symbol: mhe_function_that_nobody_defines"},
};
#define N_EXPECTED ((int32_t)(sizeof expected / sizeof expected[0]))

static int open_registry(void **state) {
    mhi_registry *registry = NULL;
    if (setenv("MHE_PLUGIN_PATH", ABI_PLUGIN_DIR, 1) != 0 ||
        mhi_registry_create(NULL, &registry, NULL) != MHE_OK) {
        return -1;
    }
    *state = registry;
    return 0;
}

static int close_registry(void **state) {
    mhi_registry_free(*state);
    return 0;
}

static void each_bad_file_is_refused_with_its_reason(void **state) {
    mhi_registry *registry = *state;
    assert_in_range(mhi_registry_refused_count(registry), N_EXPECTED, 10 * N_EXPECTED);
    for (int32_t i = 0; i < N_EXPECTED; i++) {
        char line[1024];
        (void)snprintf(line, sizeof line, "%s/%s: %s", ABI_PLUGIN_DIR, expected[i].file,
                       expected[i].reason);
        assert_string_equal(mhi_registry_refused(registry, i), line);
    }
}

static void the_good_one_beside_them_is_found(void **state) {
    const mhe_plugin *plugin = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_registry_find(*state, "test.cost.abi", MHE_COST_IFACE, &plugin, &err),
                     MHE_OK);
    assert_string_equal(plugin->version, "1.0.0");
}

static void a_missing_plugin_is_told_with_the_refused_files(void **state) {
    const mhe_plugin *plugin = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_registry_find(*state, "test.cost.abo", NULL, &plugin, &err), MHE_E_PLUGIN);
    assert_null(plugin);
    assert_non_null(strstr(err.text, "did you mean 'test.cost.abi'?"));
    assert_non_null(strstr(err.text, "abi_major.so: built for ABI 1.2"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_bad_file_is_refused_with_its_reason),
        cmocka_unit_test(the_good_one_beside_them_is_found),
        cmocka_unit_test(a_missing_plugin_is_told_with_the_refused_files),
    };
    return cmocka_run_group_tests(tests, open_registry, close_registry);
}
