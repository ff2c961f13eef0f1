/* SPDX-License-Identifier: Apache-2.0 */
/* What the room says of external loads that are wrong in one way, and of sound ones: nothing. */
#include "believe_rig.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Two plates under a walking person of 80 kg, y up: `edit` makes the force, point and torque of
 * each sample wrong in one way. */
typedef void load_edit(double t, int foot, double v[9]);

static void write_loads(const char *folder, load_edit *edit) {
    char path[300];
    (void)snprintf(path, sizeof path, "%s/l.xml", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    (void)fputs("<ExternalLoads><datafile>l.sto</datafile><objects>", file);
    for (int foot = 0; foot < 2; foot++) {
        (void)fprintf(file,
                      "<ExternalForce name=\"foot%d\"><applied_to_body>leg</applied_to_body>"
                      "<force_identifier>f%d</force_identifier><point_identifier>p%d"
                      "</point_identifier><torque_identifier>t%d</torque_identifier>"
                      "</ExternalForce>",
                      foot, foot, foot, foot);
    }
    (void)fputs("</objects></ExternalLoads>", file);
    (void)fclose(file);
    (void)snprintf(path, sizeof path, "%s/l.sto", folder);
    file = fopen(path, "w");
    assert_non_null(file);
    (void)fputs("l\nversion=1\nendheader\ntime", file);
    for (int i = 0; i < 18; i++) {
        (void)fprintf(file, "\t%c%d%c", "fpt"[i % 9 / 3], i / 9, "xyz"[i % 3]);
    }
    for (int k = 0; k < FRAMES; k++) {
        const double t = k / 100.0;
        (void)fprintf(file, "\n%g", t);
        for (int foot = 0; foot < 2; foot++) {
            const double on = fmax(0, sin(7 * t + 3.1416 * foot));
            double v[9] = {30 * sin(5 * t), 850 * on, 10, 0.3, 0, 0.1, 0, on, 0};
            v[0] *= on;
            v[2] *= on;
            v[3] = on > 0 ? v[3] : 331; /* what a plate says of no force */
            if (edit != NULL) {
                edit(t, foot, v);
            }
            for (int i = 0; i < 9; i++) {
                (void)fprintf(file, "\t%.9g", v[i]);
            }
        }
    }
    (void)fputs("\n", file);
    (void)fclose(file);
}

/* A pelvis that moves freely, or a base that stands: whose weight the loads have not to carry. */
static const mhe_coordinate pelvis[] = {{.name = "tx"}, {.name = "ty"}};

static void believe_loads_of(rig *r, const char *folder, load_edit *edit,
                             const mhe_coordinate *base) {
    static mhe_body body = {.name = "leg", .parent = -1, .mass = 80};
    static mhe_description person;
    static char path[300];
    person = believe_model;
    person.coordinates = base;
    person.n_bodies = 1;
    person.bodies = &body;
    person.gravity[1] = -9.81;
    write_loads(folder, edit);
    (void)snprintf(path, sizeof path, "%s/l.xml", folder);
    r->run.data.external_loads = path;
    if (mhi_believe_loads(&r->run, &person, &r->recording, &r->findings, &r->err) != MHE_OK) {
        fail_msg("%s", r->err.text);
    }
}

static void believe_loads(rig *r, const char *folder, load_edit *edit) {
    believe_loads_of(r, folder, edit, pelvis);
}

static void z_up(double t, int foot, double v[9]) {
    (void)t, (void)foot;
    for (int i = 0; i < 9; i += 3) { /* (x, y, z) of the model is (x, z, -y) of the laboratory */
        const double y = v[i + 1];
        v[i + 1] = -v[i + 2];
        v[i + 2] = y;
    }
}

static void on_the_plate(double t, int foot, double v[9]) {
    (void)t, (void)foot;
    for (int i = 0; i < 3; i++) {
        v[i] = -v[i];
    }
}

static void kilonewtons(double t, int foot, double v[9]) {
    (void)t, (void)foot;
    for (int i = 0; i < 3; i++) {
        v[i] *= 0.1;
    }
}

static void far_away(double t, int foot, double v[9]) {
    (void)t;
    v[3] += foot == 1 ? 2.5 : 0;
}

static void drifting(double t, int foot, double v[9]) {
    v[1] += foot == 0 ? 30 * t : 0;
}

static void runs_away(double t, int foot, double v[9]) {
    (void)t;
    v[3] += foot == 1 && v[1] < 90 ? 331 : 0;
}

static void loads_against_gravity_weight_and_markers(void **state) {
    char folder[256];
    static const struct {
        load_edit *edit;
        int32_t weight;
        const char *says;
    } cases[] = {
        {z_up, MHI_FINDING_USELESS, "the loads push along (0.0"},
        {on_the_plate, MHI_FINDING_USELESS, "pull the body down"},
        {kilonewtons, MHI_FINDING_DOUBTFUL, "the model weighs 785 N"},
        {far_away, MHI_FINDING_DOUBTFUL, "'foot1' acts up to 2.26"},
        {drifting, MHI_FINDING_DOUBTFUL, "'foot0' shows"},
        {runs_away, MHI_FINDING_DOUBTFUL, "'foot1' acts 33"},
    };
    (void)state;
    assert_non_null(test_folder(folder, sizeof folder));
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        rig *r = new_rig();
        believe_loads(r, folder, cases[i].edit);
        expect(r, cases[i].weight, cases[i].says);
        assert_int_equal(r->findings.n, 1);
        free_rig(r);
    }
    rig *r = new_rig(); /* sound ones, with points far off where there is no force */
    believe_loads(r, folder, NULL);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
    r = new_rig(); /* axes of the laboratory, and a config that says so */
    const double turn[9] = {1, 0, 0, 0, 0, 1, 0, -1, 0};
    memcpy(r->run.transform.turn, turn, sizeof turn);
    r->run.transform.scale = 1;
    believe_loads(r, folder, z_up);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
    r = new_rig(); /* a weight pulls a hand down, and rightly so */
    believe_loads_of(r, folder, on_the_plate, believe_model.coordinates);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
}

/* The foot's markers are where the forces act; the file gives them to the leg. */
static void loads_on_the_wrong_body(void **state) {
    static mhe_body bodies[] = {{.name = "leg", .parent = -1, .mass = 80},
                                {.name = "foot", .parent = 0}};
    mhe_marker markers[MARKERS];
    mhe_description person = believe_model;
    char folder[256], path[300];
    (void)state;
    assert_non_null(test_folder(folder, sizeof folder));
    write_loads(folder, NULL);
    (void)snprintf(path, sizeof path, "%s/l.xml", folder);
    person.coordinates = pelvis;
    person.n_bodies = 2;
    person.bodies = bodies;
    person.gravity[1] = -9.81;
    memcpy(markers, believe_model.markers, sizeof markers);
    person.markers = markers;
    for (int wrong = 0; wrong < 2; wrong++) {
        markers[0].body = markers[1].body = wrong;
        markers[2].body = !wrong;
        rig *r = new_rig();
        r->run.data.external_loads = path;
        assert_int_equal(mhi_believe_loads(&r->run, &person, &r->recording, &r->findings, &r->err),
                         MHE_OK);
        assert_int_equal(r->findings.n, 2 * wrong); /* of two feet */
        if (wrong) {
            expect(r, MHI_FINDING_DOUBTFUL, "'foot1' is applied to leg, but acts");
        }
        free_rig(r);
    }
}

/* Two seconds of loads that seem to be half an hour. */
static void loads_in_milliseconds_are_named(void **state) {
    char folder[256], path[300];
    (void)state;
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/l.sto", folder);
    static mhe_body leg = {.name = "leg", .parent = -1, .mass = 80};
    mhe_description person = believe_model;
    person.coordinates = pelvis;
    person.bodies = &leg;
    person.gravity[1] = -9.81;
    rig *r = new_rig();
    write_loads(folder, NULL); /* its xml */
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    (void)fputs("l\nversion=1\nendheader\ntime", file);
    for (int i = 0; i < 18; i++) {
        (void)fprintf(file, "\t%c%d%c", "fpt"[i % 9 / 3], i / 9, "xyz"[i % 3]);
    }
    for (int k = 0; k < FRAMES; k++) {
        (void)fprintf(file, "\n%d", 1000 * k);
        for (int i = 0; i < 18; i++) {
            (void)fputs(i % 9 == 1 ? "\t400" : "\t0", file);
        }
    }
    (void)fputs("\n", file);
    (void)fclose(file);
    (void)snprintf(path, sizeof path, "%s/l.xml", folder);
    r->run.data.external_loads = path;
    assert_int_equal(mhi_believe_loads(&r->run, &person, &r->recording, &r->findings, &r->err),
                     MHE_OK);
    expect(r, MHI_FINDING_USELESS, "rows are 1000 s apart");
    free_rig(r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(loads_against_gravity_weight_and_markers),
        cmocka_unit_test(loads_on_the_wrong_body),
        cmocka_unit_test(loads_in_milliseconds_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
