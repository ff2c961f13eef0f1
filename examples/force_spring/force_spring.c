/* SPDX-License-Identifier: Apache-2.0 */
/* force_spring: a spring and a damper on every coordinate, or on one.
 *
 *     tau = -stiffness (q - rest) - damping v */
#include <mhe/force.h>

#include <stdlib.h>
#include <string.h>

struct spring { /* filled and range-checked by the core */
    const char *coordinate;
    double stiffness, damping, rest;
};

static const mhe_option spring_options[] = {
    MHE_OPT_TEXT(struct spring, coordinate, 0, "", "Coordinate it acts on; empty: all."),
    MHE_OPT_REAL(struct spring, stiffness, 1, 0, 1e6, "N m/rad", "Stiffness (N/m of sliders)."),
    MHE_OPT_REAL(struct spring, damping, 0.1, 0, 1e6, "N m s/rad", "Damping."),
    MHE_OPT_REAL(struct spring, rest, 0, -1e3, 1e3, "rad", "Where it is at rest (m of sliders)."),
};

typedef struct instance {
    struct spring config;
    int32_t n_q, only; /* -1: all */
} instance;

static mhe_status spring_create(const mhe_host *host, const mhe_description *description,
                                const void *config, void **self, mhe_error *err) {
    (void)host;
    instance *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->config = *(const struct spring *)config;
    s->n_q = description->n_coordinates;
    s->only = -1;
    const char *wanted = s->config.coordinate;
    for (int32_t i = 0; i < s->n_q && wanted[0] != '\0'; i++) {
        s->only = strcmp(description->coordinates[i].name, wanted) == 0 ? i : s->only;
    }
    if (wanted[0] != '\0' && s->only < 0) {
        const mhe_status status =
            mhe_fail(err, MHE_E_CONFIG, "the model has no coordinate '%s'", wanted);
        free(s);
        return status;
    }
    *self = s;
    return MHE_OK;
}

static void spring_destroy(void *self) {
    free(self);
}

static mhe_status spring_layout(const void *self, mhe_force_layout *out, mhe_error *err) {
    (void)self, (void)err;
    out->name = "spring";
    out->generalised = 1;
    return MHE_OK;
}

static mhe_status spring_evaluate(const void *self, const mhe_force_point *at,
                                  const mhe_force_values *out, mhe_error *err) {
    const instance *s = self;
    (void)err;
    for (int32_t i = 0; i < s->n_q; i++) {
        if (s->only >= 0 && i != s->only) {
            continue; /* outputs are zeroed before */
        }
        if (out->tau != NULL) { /* NULL: not wanted */
            out->tau[i] =
                -s->config.stiffness * (at->q[i] - s->config.rest) - s->config.damping * at->v[i];
        }
        if (out->tau_q != NULL) {
            out->tau_q[i * s->n_q + i] = -s->config.stiffness;
        }
        if (out->tau_v != NULL) {
            out->tau_v[i * s->n_q + i] = -s->config.damping;
        }
    }
    return MHE_OK;
}

static const mhe_force_ops spring_ops = {.size = sizeof spring_ops,
                                         .create = spring_create,
                                         .destroy = spring_destroy,
                                         .layout = spring_layout,
                                         .evaluate = spring_evaluate};

static const mhe_plugin spring_plugin = {.size = sizeof spring_plugin,
                                         .id = "org.example.force.spring",
                                         .version = "1.0.0",
                                         .summary = "A spring and a damper on coordinates.",
                                         .iface = MHE_FORCE_IFACE,
                                         .ops = &spring_ops,
                                         MHE_PLUGIN_OPTIONS(struct spring, spring_options)};

MHE_PLUGIN_LIBRARY(&spring_plugin)
