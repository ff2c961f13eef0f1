/* SPDX-License-Identifier: Apache-2.0 */
/* force_external_loads: forces and torques on bodies from a file (OpenSim's ExternalLoads).
 *
 * Between the rows of the file a load is interpolated as a wrench about the origin of the frame
 * that it is given in, where force and point have the same: a point alone means nothing where the
 * force is small (centres of pressure run away there). Its inputs are then the force, a point that
 * stays at that origin, and the moment about it. Where the frames differ, force, point and torque
 * are linear each. */
#include <mhe/force.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PER_LOAD 9

struct loads_config {
    const char *file;
    mhe_real_list turn, shift;
    double scale;
};

struct loads {
    const mhe_external_loads_service *service;
    const mhe_external_loads *file;
    int32_t n_w;
    double *values; /* [n_rows x n_w] ready to be interpolated */
    char (*names)[96];
    const char **labels, **units;
};

static const mhe_option loads_options[] = {
    MHE_OPT_PATH(struct loads_config, file, MHE_OPT_REQUIRED,
                 "ExternalLoads .xml, with the .mot or .sto that it names."),
    MHE_OPT_REALS(struct loads_config, turn, 0, -1, 1, "1",
                  "From the file's ground to the model's: a rotation matrix row by row; none: they "
                  "are the same. data.external_loads takes it from data.transform."),
    MHE_OPT_REALS(struct loads_config, shift, 0, -1e6, 1e6, "m", "Added to points afterwards."),
    MHE_OPT_REAL(struct loads_config, scale, 1, -1e6, 1e6, "1",
                 "Factor of points before; below 0 all is mirrored."),
};

static void loads_destroy(void *self) {
    struct loads *s = self;
    if (s == NULL) {
        return;
    }
    if (s->service != NULL) {
        s->service->free(s->file);
    }
    free(s->values);
    free(s->names);
    free((void *)s->labels);
    free((void *)s->units);
    free(s);
}

/* Force, point and torque as the wrench about the frame's origin: force, 0, moment. */
static void loads_as_wrench(double *v) {
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        v[6 + i] += v[3 + j] * v[k] - v[3 + k] * v[j];
    }
    v[3] = v[4] = v[5] = 0;
}

/* Vector of ground, turned; mirrored where points are. A torque is none of the two that a mirror
 * turns round: it keeps its sense. */
static void loads_turn(const struct loads_config *c, double sign, double *v) {
    const double from[3] = {v[0], v[1], v[2]};
    for (int i = 0; i < 3; i++) {
        const double *row = c->turn.n == 9 ? c->turn.values + 3 * (ptrdiff_t)i : NULL;
        v[i] =
            sign * (row == NULL ? from[i] : row[0] * from[0] + row[1] * from[1] + row[2] * from[2]);
    }
}

/* Force, point and torque of the file's ground in the model's. */
static void loads_to_model(const struct loads_config *c, const mhe_load *load, double *v) {
    const double mirror = c->scale < 0 ? -1 : 1;
    if (load->axes < 0) {
        loads_turn(c, mirror, v);
        loads_turn(c, 1, v + 6);
    }
    if (load->origin < 0) {
        loads_turn(c, c->scale, v + 3);
        for (int i = 0; i < 3 && c->shift.n == 3; i++) {
            v[3 + i] += c->shift.values[i];
        }
    }
}

static mhe_status loads_check(const struct loads_config *c, mhe_error *err) {
    if (c->turn.n != 0 && c->turn.n != 9) {
        return mhe_fail(err, MHE_E_CONFIG, "turn: %d values; a matrix has 9", (int)c->turn.n);
    }
    if (c->shift.n != 0 && c->shift.n != 3) {
        return mhe_fail(err, MHE_E_CONFIG, "shift: %d values; three are needed", (int)c->shift.n);
    }
    return c->scale == 0 ? mhe_fail(err, MHE_E_CONFIG, "scale: 0 leaves nothing") : MHE_OK;
}

static mhe_status loads_prepare(const struct loads_config *c, struct loads *s) {
    static const char *const parts[] = {"force", "point", "torque"};
    static const char *const units[] = {"N", "m", "N m"};
    const mhe_external_loads *f = s->file;
    s->n_w = PER_LOAD * f->n_loads;
    const size_t n = (size_t)s->n_w, rows = (size_t)f->n_rows;
    s->values = malloc(rows * n * sizeof *s->values);
    s->names = calloc(n, sizeof *s->names);
    s->labels = calloc(n, sizeof *s->labels);
    s->units = calloc(n, sizeof *s->units);
    if (s->values == NULL || s->names == NULL || s->labels == NULL || s->units == NULL) {
        return MHE_E_MEMORY;
    }
    memcpy(s->values, f->values, rows * n * sizeof *s->values);
    for (int32_t l = 0; l < f->n_loads; l++) {
        for (size_t k = 0; k < rows; k++) {
            loads_to_model(c, &f->loads[l], s->values + k * n + PER_LOAD * (size_t)l);
        }
        for (size_t k = 0; k < rows && f->loads[l].axes == f->loads[l].origin; k++) {
            loads_as_wrench(s->values + k * n + PER_LOAD * (size_t)l);
        }
        for (int32_t i = 0; i < PER_LOAD; i++) {
            const int32_t at = PER_LOAD * l + i;
            (void)snprintf(s->names[at], sizeof s->names[at], "%.64s_%s_%c", f->names[l],
                           parts[i / 3], "xyz"[i % 3]);
            s->labels[at] = s->names[at];
            s->units[at] = units[i / 3];
        }
    }
    return MHE_OK;
}

static mhe_status loads_create(const mhe_host *host, const mhe_description *description,
                               const void *config, void **self, mhe_error *err) {
    const struct loads_config *c = config;
    if (loads_check(c, err) != MHE_OK) {
        return MHE_E_CONFIG;
    }
    struct loads *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the loads");
    }
    s->service = host->service(host, MHE_EXTERNAL_LOADS_SERVICE);
    mhe_status status = s->service == NULL
                            ? mhe_fail(err, MHE_E_UNSUPPORTED, "this program reads no such files")
                            : s->service->read(c->file, description, &s->file, err);
    if (status == MHE_OK) {
        status = loads_prepare(c, s);
        if (status != MHE_OK) {
            (void)mhe_fail(err, status, "no memory for the loads");
        }
    }
    if (status != MHE_OK) {
        loads_destroy(s);
        return status;
    }
    *self = s;
    return MHE_OK;
}

static mhe_status loads_layout(const void *self, mhe_force_layout *out, mhe_error *err) {
    const struct loads *s = self;
    (void)err;
    out->name = "external_loads";
    out->n_inputs = s->n_w;
    out->input_names = s->labels;
    out->input_units = s->units;
    out->n_loads = s->file->n_loads;
    out->loads = s->file->loads;
    return MHE_OK;
}

static mhe_status loads_evaluate(const void *self, const mhe_force_point *at,
                                 const mhe_force_values *out, mhe_error *err) {
    const struct loads *s = self;
    (void)err;
    if (out->load != NULL) {
        memcpy(out->load, at->input, sizeof *out->load * (size_t)s->n_w);
    }
    for (int32_t i = 0; i < s->n_w && out->load_w != NULL; i++) {
        out->load_w[i * s->n_w + i] = 1;
    }
    return MHE_OK;
}

static mhe_status loads_input(const void *self, double t, double *w, mhe_error *err) {
    const struct loads *s = self;
    const mhe_external_loads *f = s->file;
    const int32_t last = f->n_rows - 1;
    const double slack = 2e-3; /* s: times are printed with so many digits */
    (void)err;
    if (!(t >= f->time[0] - slack && t <= f->time[last] + slack)) {
        for (int32_t i = 0; i < s->n_w; i++) {
            w[i] = NAN;
        }
        return MHE_OK;
    }
    int32_t row = 0;
    for (int32_t above = last; above - row > 1;) {
        const int32_t middle = (row + above) / 2;
        if (t >= f->time[middle]) {
            row = middle;
        } else {
            above = middle;
        }
    }
    const int32_t next = row < last ? row + 1 : row;
    const double span = f->time[next] - f->time[row];
    double part = span > 0 ? (t - f->time[row]) / span : 0;
    part = part < 0 ? 0 : part > 1 ? 1 : part;
    const double *a = s->values + (ptrdiff_t)row * s->n_w;
    const double *b = s->values + (ptrdiff_t)next * s->n_w;
    for (int32_t i = 0; i < s->n_w; i++) {
        w[i] = a[i] + part * (b[i] - a[i]);
    }
    return MHE_OK;
}

static mhe_status loads_covers(const void *self, double *first, double *last, mhe_error *err) {
    const struct loads *s = self;
    (void)err;
    *first = s->file->time[0];
    *last = s->file->time[s->file->n_rows - 1];
    return MHE_OK;
}

static const mhe_force_ops loads_ops = {.size = sizeof loads_ops,
                                        .create = loads_create,
                                        .destroy = loads_destroy,
                                        .layout = loads_layout,
                                        .evaluate = loads_evaluate,
                                        .input = loads_input,
                                        .covers = loads_covers};

static const mhe_plugin loads_plugin = {
    .size = sizeof loads_plugin,
    .id = "mhe.force.external-loads",
    .version = "0.2.0",
    .summary = "Forces and torques on bodies from a file: ground reaction, a weight in the hand "
               "(OpenSim's ExternalLoads).",
    .reference = "doi:10.1371/journal.pcbi.1006223",
    .iface = MHE_FORCE_IFACE,
    .ops = &loads_ops,
    MHE_PLUGIN_OPTIONS(struct loads_config, loads_options)};

MHE_PLUGIN_LIBRARY(&loads_plugin)
