/* SPDX-License-Identifier: Apache-2.0 */
/* What each check of the room says of data that are wrong in one way, and of sound ones: nothing.
 * The markers' frame and the estimate's verdict are asked by tests/cases and corruptions.sh. */
#define _DEFAULT_SOURCE /* mkdtemp */
#include "believe/believe.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FRAMES 200
#define MUSCLES 4
#define MARKERS 3

static const mhe_coordinate coordinates[] = {
    {.name = "flex", .rotational = 1, .lower = -0.2, .upper = 2.6},
    {.name = "slide", .rotational = 0, .lower = -1, .upper = 1}};
static const mhe_muscle muscles[] = {{.name = "A"}, {.name = "B"}, {.name = "C"}, {.name = "D"}};
static const mhe_motion hinge = {.kind = MHE_MOTION_ROTATION, .coordinate = 0, .axis = {0, 0, 1}};
static const mhe_body bodies[] = {
    {.name = "fore", .parent = -1, .n_motions = 1, .motions = &hinge}};
static const mhe_marker markers[] = {{.name = "K"}, {.name = "L"}, {.name = "BASE", .body = -1}};

static const mhe_description model = {.size = sizeof model,
                                      .n_bodies = 1,
                                      .bodies = bodies,
                                      .n_coordinates = 2,
                                      .coordinates = coordinates,
                                      .n_muscles = MUSCLES,
                                      .muscles = muscles,
                                      .n_markers = MARKERS,
                                      .markers = markers};

/* Two seconds of sound data. */
typedef struct rig {
    double time[FRAMES], emg[FRAMES * MUSCLES], angles[FRAMES * 2], markers[FRAMES * 3 * MARKERS];
    mhi_recording recording;
    mhi_run run;
    mhi_findings findings;
    mhe_error err;
} rig;

static rig *new_rig(void) {
    rig *r = calloc(1, sizeof *r);
    assert_non_null(r);
    for (int k = 0; k < FRAMES; k++) {
        const double t = r->time[k] = k / 100.0;
        for (int i = 0; i < MUSCLES; i++) {
            r->emg[k * MUSCLES + i] = fmax(0, 0.1 * (i + 1) * sin(5 * t + i)); /* 0: at rest */
        }
        r->angles[2 * k] = 0.5 + 0.3 * sin(3 * t);
        r->angles[2 * k + 1] = 0.1 * t;
        for (int i = 0; i < 3 * MARKERS; i++) {
            r->markers[k * 3 * MARKERS + i] = 0.1 * i + 0.05 * sin(3 * t + i);
        }
    }
    r->recording = (mhi_recording){.n_frames = FRAMES,
                                   .rate = 100,
                                   .time = r->time,
                                   .emg = r->emg,
                                   .angles = r->angles,
                                   .markers = r->markers,
                                   .n_q = 2};
    r->run.path = "run.yaml";
    r->run.data.emg = "emg.sto";
    r->run.data.markers = "m.trc";
    return r;
}

static void free_rig(rig *r) {
    mhi_findings_free(&r->findings);
    free(r);
}

/* One finding of this weight with these words. */
static void expect(const rig *r, int32_t weight, const char *text) {
    for (int32_t i = 0; i < r->findings.n; i++) {
        const mhi_finding *f = &r->findings.all[i];
        if (f->weight == weight && strstr(f->text, text) != NULL) {
            assert_true(strlen(mhi_finding_remedy(f)) > 0);
            return;
        }
    }
    fail_msg("'%s' is not among %d findings (first: %s)", text, (int)r->findings.n,
             r->findings.n > 0 ? r->findings.all[0].text : "none");
}

static mhe_status check_emg(rig *r) {
    return mhi_believe_emg(&r->run, &model, &r->recording, &r->findings, &r->err);
}

static mhe_status check_angles(rig *r, int32_t in_degrees) {
    const mhi_angles_source source = {"a.mot", 7, in_degrees};
    return mhi_believe_angles(&model, &r->recording, &source, &r->findings, &r->err);
}

static void sound_data_give_no_finding(void **state) {
    (void)state;
    rig *r = new_rig();
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(check_angles(r, 0), MHE_OK);
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    assert_int_equal(r->findings.n, 0);
    assert_string_equal(mhi_usable(mhi_findings_weight(&r->findings)), "yes");
    free_rig(r);
}

static void emg_that_is_none_is_refused(void **state) {
    (void)state;
    static const struct {
        double factor, offset;
        const char *text;
    } cases[] = {{100, 0, "percent?"}, {4000, 0, "raw EMG?"}, {1, -0.2, "is this raw EMG?"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        rig *r = new_rig();
        for (int k = 0; k < FRAMES * MUSCLES; k++) {
            r->emg[k] = cases[i].factor * r->emg[k] + cases[i].offset;
        }
        assert_int_equal(check_emg(r), MHE_E_INPUT);
        assert_non_null(strstr(r->err.text, "emg.sto: values from"));
        assert_non_null(strstr(r->err.text, cases[i].text));
        free_rig(r);
    }
}

static void doubtful_emg_is_named(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->emg[k * MUSCLES] = 0;                                            /* dead */
        r->emg[k * MUSCLES + 1] = k < 100 ? r->emg[k * MUSCLES + 1] : 0.17; /* held */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "nothing but zeros: A");
    expect(r, MHI_FINDING_DOUBTFUL, "more than 0.3 s: B");
    assert_int_equal(r->findings.n, 2);
    free_rig(r);
    r = new_rig();
    for (int i = 0; i < MUSCLES; i++) {
        double most = 0;
        for (int k = 0; k < FRAMES; k++) {
            most = fmax(most, r->emg[k * MUSCLES + i]);
        }
        for (int k = 0; k < FRAMES; k++) {
            r->emg[k * MUSCLES + i] /= most;
        }
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "the maximum is exactly 1 in 4 of 4 channels");
    free_rig(r);
    r = new_rig();
    for (int k = 80 * MUSCLES; k < FRAMES * MUSCLES; k++) {
        r->emg[k] = NAN;
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "EMG from 0 to 0.79 s, frames from 0 to 1.99 s: 40 %");
    free_rig(r);
}

static void a_copied_column_is_told(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->emg[k * MUSCLES + 2] = r->emg[k * MUSCLES];
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_NOTE, "columns that are the same to the last digit: C as A");
    assert_int_equal(r->findings.n, 1);
    r->emg[20 * MUSCLES] += 1e-12;
    mhi_findings_free(&r->findings);
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
}

static void muscles_rest_at_times(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += r->emg[k] == 0 ? 0.01 : 0; /* rest, written with two decimals */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 0);
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += k % MUSCLES > 0 ? 0.03 : 0; /* one still rests */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += 0.03 + 1e-4 * (k % 7); /* hum */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "none of 4 muscles is ever at rest");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
}

static void a_cost_without_its_emg_is_told(void **state) {
    (void)state;
    static const mhe_plugin cost = {.id = "mhe.cost.emg-markers-high"};
    mhi_use use = {.plugin = &cost, .weight = 1};
    rig *r = new_rig();
    r->recording.emg = NULL;
    r->run.costs = &use;
    r->run.n_costs = 1;
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "a cost tracks EMG, but data.emg is not given");
    free_rig(r);
}

static void angles_against_their_ranges(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] *= 57.29577951308232;
    }
    assert_int_equal(check_angles(r, 0), MHE_E_INPUT);
    assert_non_null(strstr(r->err.text, "a.mot:7: 'flex' goes from 11.4"));
    assert_non_null(strstr(r->err.text, "'inDegrees=yes'"));
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] /= 57.29577951308232; /* radians that the header calls degrees */
    }
    assert_int_equal(check_angles(r, 1), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "no angle is larger than 0.8 degrees");
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] *= -1; /* the wrong sign */
    }
    assert_int_equal(check_angles(r, 0), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "'flex' goes from -0.8 to -0.2");
    free_rig(r);
}

static void markers_that_jump_together(void **state) {
    (void)state;
    const int width = 3 * MARKERS;
    rig *r = new_rig();
    for (int k = 120 * width; k < FRAMES * width; k++) {
        r->markers[k] += k % 3 == 1 ? 0.04 : 0; /* someone bumps into a camera */
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "most markers jump by 40 mm from 1.19 to 1.2 s");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->time[k] += k >= 120 ? 0.5 : 0; /* a gap in which they moved */
        for (int i = 0; i < width; i++) {
            r->markers[k * width + i] += k >= 120 ? 0.04 : 0;
        }
        /* carried by the ground: it rests */
        memcpy(&r->markers[k * width + 6], &r->markers[6], 3 * sizeof(double));
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
}

static void markers_that_hold_or_are_gone(void **state) {
    (void)state;
    const int width = 3 * MARKERS;
    rig *r = new_rig();
    for (int k = 100; k < 150; k++) {
        memcpy(&r->markers[k * width], &r->markers[99 * width], 3 * sizeof(double));
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "repeat to the last digit: K (25 %");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 1; k < FRAMES; k += 2) { /* 50 Hz written at 100 Hz */
        memcpy(&r->markers[k * width], &r->markers[(k - 1) * width],
               (size_t)width * sizeof(double));
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "50 % of the frames repeat all markers of the one before");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES * width; k++) {
        r->markers[k] = k < 60 * width ? NAN : r->markers[k];
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "30 % of the frames have no marker");
    for (int k = 0; k < FRAMES * width; k++) {
        r->markers[k] = NAN;
    }
    mhi_believe_markers(&r->run, &model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_USELESS, "no marker of the model is there in any frame");
    assert_string_equal(mhi_usable(mhi_findings_weight(&r->findings)), "no");
    free_rig(r);
}

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
    person = model;
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
    char folder[] = "/tmp/mhe-loads-XXXXXX";
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
    assert_non_null(mkdtemp(folder));
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
    believe_loads_of(r, folder, on_the_plate, coordinates);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
    char path[300];
    (void)snprintf(path, sizeof path, "%s/l.xml", folder);
    (void)unlink(path);
    (void)snprintf(path, sizeof path, "%s/l.sto", folder);
    (void)unlink(path);
    (void)rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(loads_against_gravity_weight_and_markers),
        cmocka_unit_test(sound_data_give_no_finding),
        cmocka_unit_test(emg_that_is_none_is_refused),
        cmocka_unit_test(doubtful_emg_is_named),
        cmocka_unit_test(a_copied_column_is_told),
        cmocka_unit_test(muscles_rest_at_times),
        cmocka_unit_test(a_cost_without_its_emg_is_told),
        cmocka_unit_test(angles_against_their_ranges),
        cmocka_unit_test(markers_that_hold_or_are_gone),
        cmocka_unit_test(markers_that_jump_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
