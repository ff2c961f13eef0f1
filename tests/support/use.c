/* SPDX-License-Identifier: Apache-2.0 */
#include "use.h"

#include "config/options.h"
#include "plugin/registry.h"

#include <string.h>

static void say_nothing(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

const mhe_host *test_host(void) {
    static const mhe_host host = {.size = sizeof host, .log = say_nothing, .service = no_service};
    return &host;
}

const mhe_plugin *test_plugin(const char *id, const char *iface) {
    static mhi_registry *registry; /* until exit */
    mhe_error err = {0};
    if (registry == NULL) {
        assert_int_equal(mhi_registry_create(test_host(), &registry, &err), MHE_OK);
        assert_int_equal(mhi_registry_add_folder(registry, MHE_TEST_PLUGIN_DIR, &err), MHE_OK);
    }
    const mhe_plugin *plugin = NULL;
    if (mhi_registry_find(registry, id, iface, &plugin, &err) != MHE_OK) {
        print_message("%s\n", err.text);
        assert_int_equal(mhi_registry_refused_count(registry), 0);
        return NULL;
    }
    return plugin;
}

const void *test_config(const mhe_plugin *plugin, const char *yaml) {
    static mhi_arena arena; /* until exit */
    mhe_error err = {0};
    mhi_tree *tree = NULL;
    void *config = mhi_arena_take(&arena, plugin->config_size);
    assert_non_null(config);
    if (mhi_tree_parse("test", yaml, strlen(yaml), &tree, &err) != MHE_OK ||
        mhi_options_fill(plugin->options, (int32_t)plugin->option_count, tree, mhi_tree_root(tree),
                         NULL, 0, plugin->id, ".", &arena, config, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    mhi_tree_free(tree);
    return config;
}
