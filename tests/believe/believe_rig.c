/* SPDX-License-Identifier: Apache-2.0 */
#include "believe_rig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const mhe_coordinate coordinates[] = {
    {.name = "flex", .rotational = 1, .lower = -0.2, .upper = 2.6},
    {.name = "slide", .rotational = 0, .lower = -1, .upper = 1}};
static const mhe_muscle muscles[] = {{.name = "A"}, {.name = "B"}, {.name = "C"}, {.name = "D"}};
static const mhe_motion hinge = {.kind = MHE_MOTION_ROTATION, .coordinate = 0, .axis = {0, 0, 1}};
static const mhe_body bodies[] = {
    {.name = "fore", .parent = -1, .n_motions = 1, .motions = &hinge}};
static const mhe_marker markers[] = {{.name = "K"}, {.name = "L"}, {.name = "BASE", .body = -1}};

const mhe_description believe_model = {.size = sizeof believe_model,
                                       .n_bodies = 1,
                                       .bodies = bodies,
                                       .n_coordinates = 2,
                                       .coordinates = coordinates,
                                       .n_muscles = MUSCLES,
                                       .muscles = muscles,
                                       .n_markers = MARKERS,
                                       .markers = markers};

rig *new_rig(void) {
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

void free_rig(rig *r) {
    mhi_findings_free(&r->findings);
    free(r);
}

void expect(const rig *r, int32_t weight, const char *text) {
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
