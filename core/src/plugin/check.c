/* SPDX-License-Identifier: Apache-2.0 */
#include "plugin/check.h"

#include "config/options.h"

#include <mhe/cost.h>
#include <mhe/force.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/sink.h>
#include <mhe/solver.h>
#include <mhe/source.h>
#include <string.h>

/* A table larger than this is taken for garbage, not for a newer version. */
#define SIZE_MAX_BELIEVED 65536u
#define COUNT_MAX_BELIEVED 4096u

#define MAX_FUNCTIONS 8

typedef struct function_entry {
    const char *name;
    uint32_t offset;
} function_entry;

typedef struct interface {
    const char *id;
    uint32_t ops_size;
    function_entry required[MAX_FUNCTIONS]; /* ends with a NULL name */
    function_entry both[2];                 /* both or neither */
} interface;

#define FN(T, f) \
    { #f, (uint32_t)offsetof(T, f) }

static const interface interfaces[] = {
    {MHE_COST_IFACE,
     sizeof(mhe_cost_ops),
     {FN(mhe_cost_ops, layout), FN(mhe_cost_ops, residual)},
     {FN(mhe_cost_ops, create), FN(mhe_cost_ops, destroy)}},
    {MHE_MUSCLE_IFACE,
     sizeof(mhe_muscle_ops),
     {FN(mhe_muscle_ops, create), FN(mhe_muscle_ops, destroy), FN(mhe_muscle_ops, layout),
      FN(mhe_muscle_ops, evaluate)},
     {{NULL, 0}, {NULL, 0}}},
    {MHE_FORCE_IFACE,
     sizeof(mhe_force_ops),
     {FN(mhe_force_ops, create), FN(mhe_force_ops, destroy), FN(mhe_force_ops, layout),
      FN(mhe_force_ops, evaluate)},
     {FN(mhe_force_ops, input), FN(mhe_force_ops, covers)}},
    {MHE_MODEL_IFACE,
     sizeof(mhe_model_ops),
     {FN(mhe_model_ops, create), FN(mhe_model_ops, destroy), FN(mhe_model_ops, context_create),
      FN(mhe_model_ops, context_destroy), FN(mhe_model_ops, kinematics),
      FN(mhe_model_ops, inverse_dynamics), FN(mhe_model_ops, forward_dynamics)},
     {{NULL, 0}, {NULL, 0}}},
    {MHE_INTEGRATOR_IFACE,
     sizeof(mhe_integrator_ops),
     {FN(mhe_integrator_ops, create), FN(mhe_integrator_ops, destroy),
      FN(mhe_integrator_ops, context_create), FN(mhe_integrator_ops, context_destroy),
      FN(mhe_integrator_ops, step)},
     {{NULL, 0}, {NULL, 0}}},
    {MHE_SOURCE_IFACE,
     sizeof(mhe_source_ops),
     {FN(mhe_source_ops, create), FN(mhe_source_ops, destroy), FN(mhe_source_ops, open),
      FN(mhe_source_ops, count), FN(mhe_source_ops, stream), FN(mhe_source_ops, read)},
     {{NULL, 0}, {NULL, 0}}},
    {MHE_SINK_IFACE,
     sizeof(mhe_sink_ops),
     {FN(mhe_sink_ops, create), FN(mhe_sink_ops, destroy), FN(mhe_sink_ops, open),
      FN(mhe_sink_ops, take), FN(mhe_sink_ops, close)},
     {{NULL, 0}, {NULL, 0}}},
    {MHE_SOLVER_IFACE,
     sizeof(mhe_solver_ops),
     {FN(mhe_solver_ops, create), FN(mhe_solver_ops, destroy), FN(mhe_solver_ops, solve)},
     {{NULL, 0}, {NULL, 0}}},
};

static const interface *find_interface(const char *id) {
    for (size_t i = 0; i < sizeof interfaces / sizeof interfaces[0]; i++) {
        if (strcmp(interfaces[i].id, id) == 0) {
            return &interfaces[i];
        }
    }
    return NULL;
}

mhe_status mhi_check_library(const mhe_library *library, mhe_error *err) {
    if (library == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s() returns NULL", MHE_PLUGIN_ENTRY);
    }
    if (library->magic != MHE_MAGIC) {
        return mhe_fail(err, MHE_E_PLUGIN, "wrong magic number 0x%08x (not a plugin table)",
                        library->magic);
    }
    if (library->abi_major != MHE_ABI_MAJOR ||
        (MHE_ABI_MAJOR == 0 && library->abi_minor != MHE_ABI_MINOR)) {
        return mhe_fail(err, MHE_E_PLUGIN, "built for ABI %d.%d, this is ABI %d.%d",
                        library->abi_major, library->abi_minor, MHE_ABI_MAJOR, MHE_ABI_MINOR);
    }
    if (library->size < offsetof(mhe_library, plugins) + sizeof library->plugins ||
        library->size > SIZE_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN, "the library table has a wrong size (%u bytes)",
                        library->size);
    }
    if (library->plugin_count == 0 || library->plugins == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "the library holds no plugin");
    }
    if (library->plugin_count > COUNT_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN, "the library claims %u plugins", library->plugin_count);
    }
    return MHE_OK;
}

/* Copy of a sized table, `size` bytes of it known to this core; what the plugin's lacks is zero. */
static void *adopt_table(const void *raw, uint32_t raw_size, uint32_t size, mhi_arena *arena) {
    void *copy = mhi_arena_take(arena, size);
    if (copy != NULL) {
        memcpy(copy, raw, raw_size < size ? raw_size : size);
    }
    return copy;
}

static int is_id(const char *id) {
    size_t n = strspn(id, "abcdefghijklmnopqrstuvwxyz0123456789.-_");
    return n > 0 && id[n] == '\0' && strchr(id, '.') != NULL;
}

static mhe_status check_texts(const mhe_plugin *p, mhe_error *err) {
    if (p->id == NULL || !is_id(p->id)) {
        return mhe_fail(err, MHE_E_PLUGIN, "a plugin has %s%s%s",
                        p->id == NULL ? "no id" : "the malformed id '", p->id == NULL ? "" : p->id,
                        p->id == NULL ? "" : "'");
    }
    if (p->version == NULL || p->summary == NULL || p->iface == NULL) {
        const char *what =
            p->version == NULL ? "version" : (p->summary == NULL ? "summary" : "interface id");
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s' has no %s", p->id, what);
    }
    return MHE_OK;
}

static int has_function(const void *ops, function_entry entry) {
    void (*function)(void) = NULL;
    memcpy(&function, (const char *)ops + entry.offset, sizeof function);
    return function != NULL;
}

/* The function table: known interface, believable size, required functions there. */
static mhe_status adopt_ops(mhe_plugin *p, mhi_arena *arena, mhe_error *err) {
    const interface *iface = find_interface(p->iface);
    if (iface == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s' has the unknown interface '%s'", p->id,
                        p->iface);
    }
    if (p->ops == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s' has no function table", p->id);
    }
    uint32_t size = *(const uint32_t *)p->ops;
    if (size < sizeof size || size > SIZE_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN,
                        "plugin '%s': the function table has a wrong size (%u bytes)", p->id, size);
    }
    p->ops = adopt_table(p->ops, size, iface->ops_size, arena);
    if (p->ops == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int i = 0; i < MAX_FUNCTIONS && iface->required[i].name != NULL; i++) {
        if (!has_function(p->ops, iface->required[i])) {
            const char *why = iface->required[i].offset + sizeof(void (*)(void)) > size
                                  ? "lies past its size"
                                  : "is NULL";
            return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s': the required function %s() of %s %s",
                            p->id, iface->required[i].name, iface->id, why);
        }
    }
    if (iface->both[0].name != NULL &&
        has_function(p->ops, iface->both[0]) != has_function(p->ops, iface->both[1])) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s': one of %s() and %s() is NULL, not both",
                        p->id, iface->both[0].name, iface->both[1].name);
    }
    return MHE_OK;
}

/* The option table, brought to this core's stride. */
static mhe_status adopt_options(mhe_plugin *p, mhi_arena *arena, mhe_error *err) {
    const uint32_t n = p->option_count;
    if (n == 0) {
        p->options = NULL;
        return MHE_OK;
    }
    if (p->options == NULL || n > COUNT_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s' claims %u options%s", p->id, n,
                        p->options == NULL ? " and has no table" : "");
    }
    if (p->option_size < offsetof(mhe_option, offset) + sizeof(uint32_t) ||
        p->option_size > SIZE_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s': an option has a wrong size (%u bytes)",
                        p->id, p->option_size);
    }
    if (p->option_size != sizeof(mhe_option)) {
        mhe_option *copy = MHI_TAKE(arena, mhe_option, n);
        if (copy == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        const size_t known =
            p->option_size < sizeof(mhe_option) ? p->option_size : sizeof(mhe_option);
        for (uint32_t i = 0; i < n; i++) {
            memcpy(&copy[i], (const char *)p->options + (size_t)i * p->option_size, known);
        }
        p->options = copy;
        p->option_size = sizeof(mhe_option);
    }
    mhe_error detail = {0};
    if (mhi_options_check(p->options, (int32_t)n, p->config_size, &detail) != MHE_OK) {
        return mhe_fail(err, MHE_E_PLUGIN, "plugin '%s': %.500s", p->id, detail.text);
    }
    return MHE_OK;
}

mhe_status mhi_check_plugin(const mhe_plugin *raw, mhi_arena *arena, const mhe_plugin **plugin,
                            mhe_error *err) {
    if (raw == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "an entry of the library table is NULL");
    }
    if (raw->size < offsetof(mhe_plugin, config_size) || raw->size > SIZE_MAX_BELIEVED) {
        return mhe_fail(err, MHE_E_PLUGIN, "a plugin's descriptor has a wrong size (%u bytes)",
                        raw->size);
    }
    mhe_plugin *p = adopt_table(raw, raw->size, sizeof *p, arena);
    if (p == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = check_texts(p, err);
    if (status == MHE_OK) {
        status = adopt_ops(p, arena, err);
    }
    if (status == MHE_OK) {
        status = adopt_options(p, arena, err);
    }
    *plugin = p;
    return status;
}
