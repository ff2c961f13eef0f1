/* SPDX-License-Identifier: Apache-2.0 */
/* Every allocation of every reader fails once, and from then on: the same content, or MHE_E_MEMORY
 * that says so; never a model with a marker less, never a file blamed for what it is not. */
#include "base/text.h"
#include "config/run.h"
#include "faults.h"
#include "io/c3d.h"
#include "io/model_file.h"
#include "io/slurp.h"
#include "io/table.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>

#define SOURCE MHE_TEST_SOURCE_DIR "/"

/* ---- what was read, as text; nothing of it is freed before nothing fails any more ---- */

static void add_numbers(mhi_text *out, const double *values, int n) {
    for (int i = 0; i < n; i++) {
        mhi_text_add(out, " %.17g", values[i]);
    }
}

static void add_points(mhi_text *out, const mhe_path_point *points, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, " | %d", (int)points[i].body);
        add_numbers(out, points[i].location, 3);
    }
}

static void add_body(mhi_text *out, const mhe_body *b) {
    mhi_text_add(out, "\n%s %d %d %.17g", b->name, (int)b->parent, (int)b->n_motions, b->mass);
    add_numbers(out, b->joint_r, 9);
    add_numbers(out, b->joint_p, 3);
    add_numbers(out, b->body_r, 9);
    add_numbers(out, b->body_p, 3);
    add_numbers(out, b->com, 3);
    add_numbers(out, b->inertia, 9);
    for (int32_t i = 0; i < b->n_motions; i++) {
        const mhe_motion *m = &b->motions[i];
        mhi_text_add(out, " | %d %d %d", (int)m->kind, (int)m->coordinate,
                     (int)m->function.n_pieces);
        add_numbers(out, m->axis, 3);
        add_numbers(out, m->function.coef, 1);
    }
}

static void add_description(mhi_text *out, const mhe_description *d) {
    mhi_text_add(out, "%s %d %d %d %d %d %d", d->name, (int)d->n_bodies, (int)d->n_coordinates,
                 (int)d->n_markers, (int)d->n_muscles, (int)d->n_unsupported, (int)d->n_warnings);
    add_numbers(out, d->gravity, 3);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        add_body(out, &d->bodies[i]);
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const mhe_coordinate *c = &d->coordinates[i];
        const double numbers[] = {c->lower, c->upper, c->value, c->speed};
        mhi_text_add(out, "\n%s", c->name);
        add_numbers(out, numbers, 4);
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        mhi_text_add(out, "\n%s %d", d->markers[i].name, (int)d->markers[i].body);
        add_numbers(out, d->markers[i].location, 3);
    }
    for (int32_t i = 0; i < d->n_muscles; i++) {
        const mhe_muscle *m = &d->muscles[i];
        const double numbers[] = {m->max_isometric_force, m->optimal_fiber_length,
                                  m->tendon_slack_length, m->pennation_angle,
                                  m->activation_time,     m->deactivation_time,
                                  m->passive_strain,      m->max_contraction_velocity};
        mhi_text_add(out, "\n%s %d", m->name, (int)m->type);
        add_numbers(out, numbers, 8);
    }
    for (int32_t i = 0; i < d->n_paths; i++) {
        mhi_text_add(out, "\n%s %d", d->paths[i].name, (int)d->paths[i].n_wraps);
        add_points(out, d->paths[i].points, d->paths[i].n_points);
    }
    mhi_text_add(out, "\n%d %d %d %d %d %d %d %d %d %d", (int)d->n_dependents, (int)d->n_constants,
                 (int)d->n_obstacles, (int)d->n_limits, (int)d->n_path_springs, (int)d->n_ligaments,
                 (int)d->n_coordinate_springs, (int)d->n_bushings, (int)d->n_actuators,
                 (int)d->n_loops);
}

static void add_table(mhi_text *out, const mhi_table *t) {
    if (t == NULL) {
        mhi_text_add(out, "none\n");
        return;
    }
    mhi_text_add(out, "%d %d %d %d", (int)t->n_rows, (int)t->n_columns, (int)t->n_labels,
                 (int)t->n_warnings);
    for (int32_t i = 0; i < t->n_labels; i++) {
        mhi_text_add(out, " %s", t->labels[i]);
    }
    add_numbers(out, t->time, t->n_rows);
    add_numbers(out, t->values, t->n_rows * t->n_columns);
}

/* ---- readers: `what` describes what was read ---- */

typedef struct reading {
    const char *path, *text;
    size_t length;
    mhi_registry *registry;
    mhi_text what;
    long allocations; /* of the reader alone */
    mhe_error err;
} reading;

typedef mhe_status (*reader)(reading *r);

static mhe_status read_model(reading *r) {
    mhe_description *d = NULL;
    mhe_status status = mhi_model_parse(r->path, r->text, r->length, &d, &r->err);
    r->allocations = faults_disarm();
    if (status == MHE_OK) {
        add_description(&r->what, d);
    }
    mhi_description_free(d);
    return status;
}

static mhe_status read_table(reading *r, mhe_status (*parse)(const char *, const char *, size_t,
                                                             mhi_table **, mhe_error *)) {
    mhi_table *t = NULL;
    mhe_status status = parse(r->path, r->text, r->length, &t, &r->err);
    r->allocations = faults_disarm();
    if (status == MHE_OK) {
        add_table(&r->what, t);
    }
    mhi_table_free(t);
    return status;
}

static mhe_status read_sto(reading *r) {
    return read_table(r, mhi_sto_parse);
}

static mhe_status read_trc(reading *r) {
    return read_table(r, mhi_trc_parse);
}

static mhe_status read_c3d(reading *r) {
    mhi_table *points = NULL, *analog = NULL;
    mhe_status status = mhi_c3d_parse(r->path, r->text, r->length, &points, &analog, &r->err);
    r->allocations = faults_disarm();
    if (status == MHE_OK) {
        add_table(&r->what, points);
        add_table(&r->what, analog);
    }
    mhi_table_free(points);
    mhi_table_free(analog);
    return status;
}

static mhe_status read_run(reading *r) {
    mhi_run *run = NULL;
    const char *const set[] = {"horizon.window=4", "costs.0.weight=2"};
    mhe_status status = mhi_run_read(r->path, set, 2, r->registry, &run, &r->err);
    r->allocations = faults_disarm();
    if (status == MHE_OK) {
        mhi_run_write(run, &r->what);
    }
    mhi_run_free(run);
    return status;
}

/* ---- torture ---- */

static void run(reader read, reading *r, long k, int onwards, mhe_status *status) {
    r->what.length = 0;
    r->what.failed = 0;
    memset(&r->err, 0, sizeof r->err);
    faults_arm(k, onwards);
    *status = read(r);
    (void)faults_disarm();
    assert_int_equal(r->what.failed, 0);
}

/* -> how many runs ended with the same content. */
static long torture(reader read, reading *r, const char *expected, int onwards) {
    mhe_status status = MHE_OK;
    long same = 0;
    const long n = r->allocations;
    for (long k = 1; k <= n; k++) {
        run(read, r, k, onwards, &status);
        if (status == MHE_OK) {
            if (strcmp(r->what.data, expected) != 0) {
                fail_msg("%s, allocation %ld%s: read, but another content", r->path, k,
                         onwards ? " and all behind it" : "");
            }
            same++;
        } else if (status != MHE_E_MEMORY || strstr(r->err.text, "memory") == NULL) {
            fail_msg("%s, allocation %ld%s: status %d: %s", r->path, k,
                     onwards ? " and all behind it" : "", (int)status, r->err.text);
        }
    }
    return same;
}

static void torture_file(reader read, const char *path, mhi_registry *registry) {
    reading r = {.path = path, .registry = registry};
    char *text = NULL;
    mhe_status status = MHE_OK;
    assert_int_equal(mhi_slurp(path, &text, &r.length, NULL), MHE_OK);
    r.text = text;
    for (int i = 0; i < 2; i++) { /* the first time libraries take what they keep */
        run(read, &r, 0, 0, &status);
        if (status != MHE_OK) {
            fail_msg("%s", r.err.text);
        }
    }
    const long n = r.allocations;
    char *expected = strdup(r.what.data);
    assert_non_null(expected);
    const long once = torture(read, &r, expected, 0);
    r.allocations = n;
    const long onwards = torture(read, &r, expected, 1);
    print_message("%s: %ld allocations; the same content %ld and %ld times, else out of memory\n",
                  path + strlen(SOURCE), n, once, onwards);
    free(expected);
    mhi_text_free(&r.what);
    free(text);
}

static void models(void **state) {
    (void)state;
    torture_file(read_model, SOURCE "models/arm19/arm19.osim", NULL);
    torture_file(read_model, SOURCE "tests/fuzz/corpus/osim/v3.osim", NULL);
    torture_file(read_model, SOURCE "tests/fuzz/corpus/osim/v4.osim", NULL);
    torture_file(read_model, SOURCE "tests/fuzz/corpus/osim/parts.osim", NULL);
    torture_file(read_model, SOURCE "tests/fuzz/corpus/biomod/arm.bioMod", NULL);
}

static void recordings(void **state) {
    (void)state;
    torture_file(read_trc, SOURCE "models/arm19/demo_markers.trc", NULL);
    torture_file(read_trc, SOURCE "tests/fuzz/corpus/trc/blanks_crlf.trc", NULL);
    torture_file(read_sto, SOURCE "models/arm19/demo_emg.sto", NULL);
    torture_file(read_sto, SOURCE "tests/fuzz/corpus/sto/v3_crlf.sto", NULL);
    torture_file(read_sto, SOURCE "tests/fuzz/corpus/sto/simm.mot", NULL);
    torture_file(read_c3d, SOURCE "tests/fuzz/corpus/c3d/intel_float.c3d", NULL);
}

/* Of a file that is wrong the fault is told, not a lack of memory. */
static void a_wrong_file_is_wrong(void **state) {
    (void)state;
    static const char text[] = "<OpenSimDocument><Model name='m'></Mode></OpenSimDocument>";
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_model_parse("m.osim", text, sizeof text - 1, &d, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "m.osim:1: Opening and ending tag mismatch"));
}

static void configs(void **state) {
    (void)state;
    mhi_registry *registry = NULL;
    assert_int_equal(mhi_registry_create(NULL, &registry, NULL), MHE_OK);
    assert_true(mhi_registry_count(registry) > 0); /* plugins are loaded before anything fails */
    torture_file(read_run, SOURCE "models/arm19/demo.yaml", registry);
    torture_file(read_run, SOURCE "models/arm19/demo_raw.yaml", registry);
    mhi_registry_free(registry);
}

int main(int argc, char **argv) {
    cmocka_set_test_filter(argc > 1 ? argv[1] : NULL);
    const struct CMUnitTest tests[] = {cmocka_unit_test(models), cmocka_unit_test(recordings),
                                       cmocka_unit_test(a_wrong_file_is_wrong),
                                       cmocka_unit_test(configs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
