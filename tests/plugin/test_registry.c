/* SPDX-License-Identifier: Apache-2.0 */
/* test_registry.c: where plugins are searched, and who wins. The same ids lie in the folders one
 * (1.0.0) and two (2.0.0). */
#define _XOPEN_SOURCE 700 /* realpath, mkdtemp */
#include "plugin/registry.h"

#include "support.h"
#include <mhe/cost.h>
#include <mhe/muscle.h>

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define ONE PLUGIN_DIR "/one"
#define TWO PLUGIN_DIR "/two"

static char logged[2048];

static void keep_log(const mhe_host *host, int32_t level, const char *text) {
    (void)host;
    if (level == MHE_LOG_WARNING && strlen(logged) + strlen(text) + 2 < sizeof logged) {
        strcat(strcat(logged, text), "\n");
    }
}

static const mhe_host host = {.size = sizeof host, .log = keep_log};

static mhi_registry *open_registry(const char *path) {
    mhi_registry *registry = NULL;
    logged[0] = '\0';
    assert_int_equal(setenv("MHE_PLUGIN_PATH", path, 1), 0);
    assert_int_equal(mhi_registry_create(&host, &registry, NULL), MHE_OK);
    return registry;
}

static const char *version_found(mhi_registry *registry) {
    const mhe_plugin *plugin = NULL;
    mhe_error err = {0};
    if (mhi_registry_find(registry, "test.cost.sample", MHE_COST_IFACE, &plugin, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return plugin->version;
}

static void the_first_folder_of_the_path_wins_and_it_is_logged(void **state) {
    (void)state;
    mhi_registry *registry = open_registry(ONE ":" TWO);
    assert_string_equal(version_found(registry), "1.0.0");
    assert_non_null(
        strstr(logged, "plugin 'test.cost.sample': " ONE "/first.so is used, " TWO "/second.so"));
    logged[0] = '\0';
    assert_string_equal(version_found(registry), "1.0.0");
    assert_string_equal(logged, ""); /* once is enough */
    const char *listed = NULL;
    for (int32_t i = 0; i < mhi_registry_refused_count(registry) && listed == NULL; i++) {
        listed = strstr(mhi_registry_refused(registry, i),
                        TWO "/second.so: 'test.cost.sample' is taken from " ONE "/first.so");
    }
    assert_non_null(listed);
    mhi_registry_free(registry);
    registry = open_registry(TWO ":" ONE);
    assert_string_equal(version_found(registry), "2.0.0");
    mhi_registry_free(registry);
}

static void a_folder_of_the_config_comes_before_the_path(void **state) {
    (void)state;
    mhi_registry *registry = open_registry(ONE);
    assert_string_equal(version_found(registry), "1.0.0");
    const int32_t count = mhi_registry_count(registry);
    assert_int_equal(mhi_registry_add_folder(registry, TWO, NULL),
                     MHE_OK); /* after a look-up too */
    assert_int_equal(mhi_registry_add_folder(registry, TWO, NULL), MHE_OK); /* twice is once */
    assert_string_equal(version_found(registry), "2.0.0");
    assert_int_equal(mhi_registry_count(registry), count);
    /* one that is in the path as well moves to the front, behind those added before */
    assert_int_equal(mhi_registry_add_folder(registry, ONE, NULL), MHE_OK);
    assert_string_equal(version_found(registry), "2.0.0");
    mhi_registry_free(registry);
}

static void folders_that_cannot_be_searched_are_told(void **state) {
    (void)state;
    mhi_registry *registry = open_registry("/no/such/folder::plugins:" ONE);
    assert_string_equal(version_found(registry), "1.0.0");
    assert_string_equal(mhi_registry_refused(registry, 0),
                        "/no/such/folder: No such file or directory");
    assert_string_equal(mhi_registry_refused(registry, 1), "plugins: not an absolute path");
    mhe_error err = {0};
    assert_int_equal(mhi_registry_add_folder(registry, "/no/such/folder", &err), MHE_E_CONFIG);
    assert_string_equal(err.text, "plugin folder '/no/such/folder': No such file or directory");
    assert_int_equal(mhi_registry_add_folder(registry, "/dev/null", &err), MHE_E_CONFIG);
    assert_string_equal(err.text, "plugin folder '/dev/null' is not a folder");
    mhi_registry_free(registry);
}

/* Whoever has an account here could put code into such a folder. */
static void folders_of_everybody_are_refused(void **state) {
    (void)state;
    char base[256], path[300], file[320];
    mhe_error err = {0};
    assert_non_null(test_folder(base, sizeof base));
    (void)snprintf(path, sizeof path, "%s/plugins", base);
    (void)snprintf(file, sizeof file, "%s/first.so", path);
    assert_int_equal(mkdir(path, 0755), 0);
    assert_int_equal(symlink(ONE "/first.so", file), 0);
    mhi_registry *registry = open_registry(path);
    assert_string_equal(version_found(registry), "1.0.0");
    mhi_registry_free(registry);

    assert_int_equal(chmod(path, 01777), 0); /* sticky: names are safe, but anybody may add one */
    registry = open_registry(path);
    assert_non_null(strstr(mhi_registry_refused(registry, 0), "everybody may write to it"));
    const mhe_plugin *plugin = NULL;
    assert_int_equal(mhi_registry_find(registry, "test.cost.sample", NULL, &plugin, &err),
                     MHE_E_PLUGIN);
    assert_non_null(strstr(err.text, "everybody may write to it"));
    assert_int_equal(mhi_registry_add_folder(registry, path, &err), MHE_E_CONFIG);
    mhi_registry_free(registry);

    assert_int_equal(chmod(path, 0755), 0);
    assert_int_equal(chmod(base, 0777), 0);
    registry = open_registry(path);
    assert_non_null(strstr(mhi_registry_refused(registry, 0), "another folder in its place"));
    mhi_registry_free(registry);
    assert_int_equal(unlink(file), 0);
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(rmdir(base), 0);
}

static void the_working_directory_is_never_searched(void **state) {
    (void)state;
    char before[4096];
    assert_non_null(getcwd(before, sizeof before));
    assert_int_equal(chdir(ONE), 0);
    mhi_registry *registry = open_registry(":.:");
    const mhe_plugin *plugin = NULL;
    assert_int_equal(mhi_registry_find(registry, "test.cost.sample", NULL, &plugin, NULL),
                     MHE_E_PLUGIN);
    mhi_registry_free(registry);
    assert_int_equal(chdir(before), 0);
}

static void the_build_trees_folder_is_searched(void **state) {
    (void)state;
    char build[4096];
    if (realpath(MHE_TEST_PLUGIN_DIR, build) == NULL) {
        skip(); /* no plugin was built */
    }
    mhi_registry *registry = open_registry("");
    const mhe_plugin *plugin = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_registry_find(registry, "x", NULL, &plugin, &err), MHE_E_PLUGIN);
    const char *searched = strstr(err.text, "searched: ");
    assert_non_null(searched);
    assert_non_null(strstr(searched, build));
    mhi_registry_free(registry);
}

static void a_wrong_name_or_kind_is_explained(void **state) {
    (void)state;
    mhi_registry *registry = open_registry(ONE);
    const mhe_plugin *plugin = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_registry_find(registry, "test.cost.sampel", MHE_COST_IFACE, &plugin, &err),
                     MHE_E_PLUGIN);
    assert_non_null(strstr(err.text, "no plugin 'test.cost.sampel' "
                                     "(did you mean 'test.cost.sample'?)"));
    assert_non_null(strstr(err.text, "searched: " ONE));
    assert_int_equal(
        mhi_registry_find(registry, "test.cost.sample", MHE_MUSCLE_IFACE, &plugin, &err),
        MHE_E_PLUGIN);
    assert_string_equal(err.text, "plugin 'test.cost.sample' is of the kind mhe.cost/2, "
                                  "here mhe.muscle/2 is wanted");
    mhi_registry_free(registry);
}

static void plugins_come_sorted_by_id(void **state) {
    (void)state;
    mhi_registry *registry = open_registry(ONE);
    for (int32_t i = 1; i < mhi_registry_count(registry); i++) {
        assert_true(strcmp(mhi_registry_at(registry, i - 1)->id, mhi_registry_at(registry, i)->id) <
                    0);
    }
    assert_null(mhi_registry_at(registry, mhi_registry_count(registry)));
    assert_null(mhi_registry_at(registry, -1));
    mhi_registry_free(registry);
}

static void tables_are_read_only_up_to_their_size(void **state) {
    (void)state;
    mhi_registry *registry = open_registry(ONE);
    const mhe_plugin *plugin = NULL;
    assert_int_equal(mhi_registry_find(registry, "test.cost.plain", NULL, &plugin, NULL), MHE_OK);
    const mhe_cost_ops *ops = plugin->ops;
    assert_non_null(ops->residual);
    assert_null(ops->jacobian); /* set behind the table's size: as if absent */
    assert_null(plugin->extension);
    mhi_registry_free(registry);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_folder_of_the_path_wins_and_it_is_logged),
        cmocka_unit_test(a_folder_of_the_config_comes_before_the_path),
        cmocka_unit_test(folders_that_cannot_be_searched_are_told),
        cmocka_unit_test(folders_of_everybody_are_refused),
        cmocka_unit_test(the_working_directory_is_never_searched),
        cmocka_unit_test(the_build_trees_folder_is_searched),
        cmocka_unit_test(a_wrong_name_or_kind_is_explained),
        cmocka_unit_test(plugins_come_sorted_by_id),
        cmocka_unit_test(tables_are_read_only_up_to_their_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
