/* SPDX-License-Identifier: Apache-2.0 */
#include "kit.h"

#include "config/options.h"
#include "config/options_table.h"
#include "plugin/guard.h"
#include "plugin/loader.h"

#include <mhe/cost.h>
#include <mhe/force.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/sink.h>
#include <mhe/solver.h>
#include <mhe/source.h>
#include <stdlib.h>
#include <string.h>

/* ---- results ---- */

static void report(mhi_kit *kit, int32_t outcome, const char *check, const char *detail) {
    mhe_testkit *k = kit->public_kit;
    k->passed += outcome == MHE_CHECK_PASSED;
    k->failed += outcome == MHE_CHECK_FAILED;
    k->skipped += outcome == MHE_CHECK_SKIPPED;
    if (k->report != NULL) {
        k->report(k->data, outcome, kit->plugin != NULL ? kit->plugin->id : "", check, detail);
    }
}

static void report_list(mhi_kit *kit, int32_t outcome, const char *check, const char *format,
                        va_list args) {
    char detail[1024];
    (void)vsnprintf(detail, sizeof detail, format, args);
    report(kit, outcome, check, detail);
}

void mhi_kit_pass(mhi_kit *kit, const char *check) {
    report(kit, MHE_CHECK_PASSED, check, "");
}

void mhi_kit_fail(mhi_kit *kit, const char *check, const char *format, ...) {
    va_list args;
    va_start(args, format);
    report_list(kit, MHE_CHECK_FAILED, check, format, args);
    va_end(args);
}

void mhi_kit_skip(mhi_kit *kit, const char *check, const char *format, ...) {
    va_list args;
    va_start(args, format);
    report_list(kit, MHE_CHECK_SKIPPED, check, format, args);
    va_end(args);
}

void mhi_kit_note(mhi_kit *kit, const char *check, const char *format, ...) {
    va_list args;
    va_start(args, format);
    report_list(kit, MHE_CHECK_NOTE, check, format, args);
    va_end(args);
}

int mhi_kit_limit(mhi_kit *kit, const char *check, double value, double limit) {
    char detail[128];
    const int passed = value <= limit; /* not for NaN */
    (void)snprintf(detail, sizeof detail, "%.2g, limit %.2g", value, limit);
    report(kit, passed ? MHE_CHECK_PASSED : MHE_CHECK_FAILED, check, detail);
    return passed;
}

/* ---- small helpers ---- */

void *mhi_kit_take(mhi_kit *kit, size_t bytes) {
    void *memory = mhi_arena_take(&kit->arena, bytes);
    if (memory == NULL) {
        abort();
    }
    return memory;
}

double mhi_kit_random(uint64_t *seed, double lower, double upper) {
    uint64_t z = (*seed += 0x9e3779b97f4a7c15u); /* splitmix64 */
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return lower + (upper - lower) * ((double)(z >> 11) * 0x1p-53);
}

void mhi_kit_set_number(mhi_kit *kit, const char *key, double value) {
    const mhe_plugin *p = kit->plugin;
    const mhe_option *o = mhi_option_find(p->options, (int32_t)p->option_count, key);
    if (o == NULL || (o->type != MHE_TYPE_REAL && o->type != MHE_TYPE_INT)) {
        return;
    }
    value = value < o->min ? o->min : (value > o->max ? o->max : value);
    char *field = (char *)kit->config + o->offset;
    if (o->type == MHE_TYPE_REAL) {
        memcpy(field, &value, sizeof value);
    } else {
        const int32_t whole = (int32_t)value;
        memcpy(field, &whole, sizeof whole);
    }
}

/* ---- running ---- */

static void host_log(const mhe_host *host, int32_t level, const char *text) {
    if (level <= MHE_LOG_WARNING) {
        mhi_kit_note(host->data, level == MHE_LOG_ERROR ? "logged error" : "logged warning", "%s",
                     text);
    }
}

static const void *host_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static const struct {
    const char *iface;
    void (*check)(mhi_kit *kit);
} interfaces[] = {
    {MHE_COST_IFACE, mhi_check_cost},     {MHE_MUSCLE_IFACE, mhi_check_muscle},
    {MHE_MODEL_IFACE, mhi_check_model},   {MHE_INTEGRATOR_IFACE, mhi_check_integrator},
    {MHE_SOLVER_IFACE, mhi_check_solver}, {MHE_SOURCE_IFACE, mhi_check_source},
    {MHE_SINK_IFACE, mhi_check_sink},     {MHE_FORCE_IFACE, mhi_check_force},
};

/* The defaults; a plugin with a required option cannot be created without knowing what it means. */
static int fill_config(mhi_kit *kit) {
    const mhe_plugin *p = kit->plugin;
    for (uint32_t i = 0; i < p->option_count; i++) {
        if ((p->options[i].flags & MHE_OPT_REQUIRED) != 0) {
            mhi_kit_skip(kit, "evaluation", "option '%s' is required and has no default",
                         p->options[i].key);
            return 0;
        }
    }
    mhe_error err = {0};
    kit->config = mhi_kit_take(kit, p->config_size);
    if (mhi_options_fill(p->options, (int32_t)p->option_count, NULL, NULL, NULL, 0, p->id, "/",
                         &kit->arena, kit->config, &err) != MHE_OK) {
        mhi_kit_fail(kit, "default options", "%s", err.text);
        return 0;
    }
    mhi_kit_pass(kit, "default options");
    return 1;
}

static mhe_status check_plugin(void *data) {
    mhi_kit *kit = data;
    for (size_t i = 0; i < sizeof interfaces / sizeof interfaces[0]; i++) {
        if (strcmp(interfaces[i].iface, kit->plugin->iface) == 0 && fill_config(kit)) {
            interfaces[i].check(kit);
        }
    }
    return MHE_OK;
}

mhe_status mhe_testkit_run(mhe_testkit *public_kit, const char *file, mhe_error *err) {
    mhi_kit kit = {.public_kit = public_kit};
    kit.host = (mhe_host){sizeof kit.host, &kit, host_log, host_service};
    const mhe_plugin *const *plugins = NULL;
    int32_t n = 0;
    mhe_error why = {0};
    mhe_status status = mhi_loader_open(file, &kit.arena, &plugins, &n, &why);
    if (status != MHE_OK) {
        mhi_kit_fail(&kit, "loads", "%s", why.text);
        mhi_arena_free(&kit.arena);
        return mhe_fail(err, status, "%s: %.500s", file, why.text);
    }
    mhi_kit_pass(&kit, "loads");
    mhi_check_exports(&kit, file);
    for (int32_t i = 0; i < n; i++) {
        kit.plugin = plugins[i];
        if (mhi_guard(check_plugin, &kit, &why) != MHE_OK) {
            mhi_kit_fail(&kit, "no exception gets out", "%s", why.text);
        }
    }
    mhi_arena_free(&kit.arena);
    return MHE_OK;
}
