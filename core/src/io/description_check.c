/* SPDX-License-Identifier: Apache-2.0 */
/* description_check.c: from drafts to a description: names are looked up, bodies put behind their
 * parents, locked coordinates made constants, and what no mechanics could use is refused. */
#include "base/text.h"
#include "io/description_builder.h"
#include "io/model_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void mhi_description_free(mhe_description *description) {
    if (description != NULL) {
        mhi_owned_description *owned = (mhi_owned_description *)(void *)description;
        mhi_arena_free(&owned->arena);
        free(owned);
    }
}

#define BODY(b, i) ((mhi_body_draft *)(b)->bodies.items[i])
#define COORDINATE(b, i) ((mhi_coordinate_draft *)(b)->coordinates.items[i])
#define MARKER(b, i) ((mhi_marker_draft *)(b)->markers.items[i])
#define MUSCLE(b, i) ((mhi_muscle_draft *)(b)->muscles.items[i])
#define GROUND (-1)

/* Index of the draft of the body `name`; -2 after an error that says `what` wanted it. */
static int32_t find_body(mhi_builder *b, const char *name, int32_t line, const char *what,
                         const char *whose) {
    if (name == NULL) {
        return GROUND;
    }
    for (int32_t i = 0; i < b->bodies.n; i++) {
        if (strcmp(BODY(b, i)->body.name, name) == 0) {
            return i;
        }
    }
    if (mhi_same_word(name, "ground")) {
        return GROUND;
    }
    const char **names = MHI_TAKE(&b->arena, const char *, b->bodies.n);
    for (int32_t i = 0; names != NULL && i < b->bodies.n; i++) {
        names[i] = BODY(b, i)->body.name;
    }
    char hint[256] = "";
    if (names != NULL) {
        mhi_suggest(hint, sizeof hint, name, names, b->bodies.n);
    }
    mhi_build_fail(b, line, "%s '%s' names an unknown body '%s'%s", what, whose, name, hint);
    return -2;
}

/* Names become columns of tables, lines of messages, words of other programs. */
static void check_name(mhi_builder *b, const char *what, const char *name, int32_t line) {
    for (const char *c = name; *c != '\0' && b->status == MHE_OK; c++) {
        if ((unsigned char)*c < ' ' || *c == 127) {
            mhi_build_fail(
                b, line,
                "%s '%s' has a control character (0x%02x) in its name, which no table of "
                "results could hold",
                what, name, (unsigned)(unsigned char)*c);
        }
    }
}

/* Fails on the first name given twice, or unfit. `at(b, i, &line)` is the i-th name. */
static void check_unique(mhi_builder *b, const char *what, int32_t n,
                         const char *(*at)(const mhi_builder *, int32_t, int32_t *)) {
    for (int32_t i = 0; i < n && b->status == MHE_OK; i++) {
        int32_t line, earlier;
        const char *name = at(b, i, &line);
        check_name(b, what, name, line);
        for (int32_t k = 0; k < i && b->status == MHE_OK; k++) {
            if (strcmp(at(b, k, &earlier), name) == 0) {
                mhi_build_fail(b, line, "%s '%s' is there twice (first in line %d)", what, name,
                               (int)earlier);
                break;
            }
        }
    }
}

static const char *body_name(const mhi_builder *b, int32_t i, int32_t *line) {
    *line = BODY(b, i)->line;
    return BODY(b, i)->body.name;
}

static const char *coordinate_name(const mhi_builder *b, int32_t i, int32_t *line) {
    *line = COORDINATE(b, i)->line;
    return COORDINATE(b, i)->coordinate.name;
}

static const char *muscle_name(const mhi_builder *b, int32_t i, int32_t *line) {
    *line = MUSCLE(b, i)->line;
    return MUSCLE(b, i)->muscle.name;
}

/* A marker that is there twice: the first is used, as biorbd does it. */
static void drop_double_markers(mhi_builder *b) {
    int32_t kept = 0;
    for (int32_t i = 0; i < b->markers.n; i++) {
        const mhi_marker_draft *marker = MARKER(b, i);
        int32_t k = 0;
        while (k < kept && strcmp(MARKER(b, k)->name, marker->name) != 0) {
            k++;
        }
        if (k < kept) {
            mhi_build_warn(b, marker->point.line,
                           "marker '%s' is there twice: the first, in line %d, is used",
                           marker->name, (int)MARKER(b, k)->point.line);
        } else {
            b->markers.items[kept++] = b->markers.items[i];
        }
    }
    b->markers.n = kept;
}

/* Mass is not negative, inertia symmetric and positive semidefinite; one that no mass distribution
 * has (triangle inequality) is used all the same, with a warning. */
static void check_inertia(mhi_builder *b, mhi_body_draft *draft) {
    mhe_body *body = &draft->body;
    double *m = body->inertia;
    double scale = fmax(fmax(fabs(m[0]), fabs(m[4])), fabs(m[8])), off = 0;
    if (body->mass < 0) {
        mhi_build_fail(b, draft->line, "body '%s' has a negative mass (%g kg)", body->name,
                       body->mass);
        return;
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            double mean = (m[3 * i + j] + m[3 * j + i]) / 2;
            off = fmax(off, fabs(m[3 * i + j] - mean));
            m[3 * i + j] = m[3 * j + i] = mean;
        }
    }
    if (off > 1e-6 * scale) {
        mhi_build_warn(b, draft->line, "the inertia of body '%s' is not symmetric: mean taken",
                       body->name);
    }
    double slack = 1e-9 * scale;
    double minor =
        fmin(fmin(m[0] * m[4] - m[1] * m[1], m[0] * m[8] - m[2] * m[2]), m[4] * m[8] - m[5] * m[5]);
    double det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                 m[2] * (m[3] * m[7] - m[4] * m[6]);
    if (fmin(fmin(m[0], m[4]), m[8]) < 0 || minor < -slack * scale ||
        det < -slack * scale * scale) {
        mhi_build_fail(b, draft->line, "the inertia of body '%s' is not positive", body->name);
    } else if (m[0] + m[4] < m[8] - slack || m[4] + m[8] < m[0] - slack ||
               m[8] + m[0] < m[4] - slack) {
        mhi_build_warn(b, draft->line,
                       "the inertia of body '%s' (%g %g %g) breaks the triangle inequality",
                       body->name, m[0], m[4], m[8]);
    }
}

static void check_muscle(mhi_builder *b, const mhi_muscle_draft *draft) {
    const mhe_muscle *m = &draft->muscle;
    const struct {
        const char *what;
        double value;
        int wrong;
    } checks[] = {
        {"maximal isometric force", m->max_isometric_force, !(m->max_isometric_force > 0)},
        {"optimal fibre length", m->optimal_fiber_length, !(m->optimal_fiber_length > 0)},
        {"tendon slack length", m->tendon_slack_length, !(m->tendon_slack_length >= 0)},
        {"pennation angle", m->pennation_angle,
         !(m->pennation_angle >= 0 && m->pennation_angle < 1.57)},
        {"maximal velocity", m->max_contraction_velocity, m->max_contraction_velocity <= 0},
        {"activation time", m->activation_time, m->activation_time <= 0},
        {"deactivation time", m->deactivation_time, m->deactivation_time <= 0},
    };
    for (size_t i = 0; i < sizeof checks / sizeof *checks; i++) {
        if (checks[i].wrong) {
            if (isnan(checks[i].value)) {
                mhi_build_fail(b, draft->line, "muscle '%s' has no %s", m->name, checks[i].what);
            } else {
                mhi_build_fail(b, draft->line, "muscle '%s': the %s cannot be %g", m->name,
                               checks[i].what, checks[i].value);
            }
        }
    }
    if (draft->points.n < 2) {
        mhi_build_fail(b, draft->line, "muscle '%s' has %d path points; it needs at least 2",
                       m->name, (int)draft->points.n);
    }
}

static void check_all(mhi_builder *b) {
    check_unique(b, "body", b->bodies.n, body_name);
    check_unique(b, "coordinate", b->coordinates.n, coordinate_name);
    drop_double_markers(b);
    check_unique(b, "muscle", b->muscles.n, muscle_name);
    for (int32_t i = 0; i < b->bodies.n; i++) {
        mhi_build_check_rotation(b, BODY(b, i), BODY(b, i)->body.joint_r);
        mhi_build_check_rotation(b, BODY(b, i), BODY(b, i)->body.body_r);
        check_inertia(b, BODY(b, i));
    }
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        const mhe_coordinate *c = &COORDINATE(b, i)->coordinate;
        if (!(c->lower <= c->upper)) {
            mhi_build_fail(b, COORDINATE(b, i)->line,
                           "the range of coordinate '%s' ends (%g) before it begins (%g)", c->name,
                           c->upper, c->lower);
        }
    }
    for (int32_t i = 0; i < b->muscles.n; i++) {
        check_muscle(b, MUSCLE(b, i));
    }
}

/* Fills place [n bodies] with each draft's position in a list with parents first, file order
 * otherwise. */
static void order_bodies(mhi_builder *b, int32_t *place, int32_t *parent) {
    int32_t n = b->bodies.n, placed = 0, progress = 1;
    for (int32_t i = 0; i < n; i++) {
        mhi_body_draft *draft = BODY(b, i);
        parent[i] = find_body(b, draft->parent, draft->line, "body", draft->body.name);
        place[i] = -1;
    }
    while (placed < n && progress && b->status == MHE_OK) {
        progress = 0;
        for (int32_t i = 0; i < n; i++) {
            if (place[i] < 0 && (parent[i] == GROUND || place[parent[i]] >= 0)) {
                place[i] = placed++;
                progress = 1;
            }
        }
    }
    for (int32_t i = 0; i < n && placed < n; i++) {
        if (place[i] < 0) {
            mhi_build_fail(b, BODY(b, i)->line, "body '%s' is its own ancestor",
                           BODY(b, i)->body.name);
        }
    }
}

/* Moves coordinates that are free and used to the description; `number` [n drafts] gets their
 * index there or -1. */
static void number_coordinates(mhi_builder *b, mhe_description *d, int32_t *number) {
    mhe_coordinate *out = MHI_TAKE(&b->arena, mhe_coordinate, b->coordinates.n);
    int32_t *used = MHI_TAKE(&b->arena, int32_t, b->coordinates.n);
    if (out == NULL || used == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return;
    }
    for (int32_t i = 0; i < b->bodies.n; i++) {
        for (int32_t k = 0; k < BODY(b, i)->motions.n; k++) {
            const mhe_motion *motion = BODY(b, i)->motions.items[k];
            if (motion->coordinate >= 0) {
                used[motion->coordinate] = 1;
            }
        }
    }
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        const mhi_coordinate_draft *draft = COORDINATE(b, i);
        number[i] = -1;
        if (draft->locked) {
            continue;
        }
        if (!used[i]) {
            mhi_build_warn(b, draft->line, "coordinate '%s' moves nothing: left out",
                           draft->coordinate.name);
            continue;
        }
        number[i] = d->n_coordinates;
        out[d->n_coordinates++] = draft->coordinate;
    }
    d->coordinates = out;
}

/* A locked coordinate's motion becomes the constant it stands at. */
static void place_motions(mhi_builder *b, const mhi_body_draft *draft, const int32_t *number,
                          mhe_body *body) {
    mhe_motion *motions = MHI_TAKE(&b->arena, mhe_motion, draft->motions.n);
    if (motions == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return;
    }
    for (int32_t k = 0; k < draft->motions.n; k++) {
        motions[k] = *(const mhe_motion *)draft->motions.items[k];
        int32_t coordinate = motions[k].coordinate;
        if (coordinate < 0) {
            continue;
        }
        motions[k].coordinate = number[coordinate];
        if (number[coordinate] < 0) {
            double value = COORDINATE(b, coordinate)->coordinate.value;
            motions[k].function =
                mhi_function_constant(b, mhi_function_value(&motions[k].function, value));
        }
    }
    body->motions = motions;
    body->n_motions = draft->motions.n;
}

static void place_bodies(mhi_builder *b, mhe_description *d, int32_t *place, int32_t *mirrored) {
    mhe_body *bodies = MHI_TAKE(&b->arena, mhe_body, b->bodies.n);
    int32_t *parent = MHI_TAKE(&b->arena, int32_t, b->bodies.n);
    int32_t *number = MHI_TAKE(&b->arena, int32_t, b->coordinates.n);
    int32_t *line = MHI_TAKE(&b->arena, int32_t, b->bodies.n);
    if (bodies == NULL || parent == NULL || number == NULL || line == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return;
    }
    order_bodies(b, place, parent);
    number_coordinates(b, d, number);
    for (int32_t i = 0; i < b->bodies.n && b->status == MHE_OK; i++) {
        mhe_body *body = &bodies[place[i]];
        *body = BODY(b, i)->body;
        line[place[i]] = BODY(b, i)->line;
        body->parent = parent[i] == GROUND ? GROUND : place[parent[i]];
        place_motions(b, BODY(b, i), number, body);
    }
    d->bodies = bodies;
    d->n_bodies = b->bodies.n;
    if (b->status == MHE_OK) {
        mhi_build_right_handed(b, bodies, d->n_bodies, line, mirrored);
    }
}

/* Body and location of a point as the description gives them. */
static mhe_path_point place_point(mhi_builder *b, const int32_t *place, const int32_t *mirrored,
                                  const mhi_point_draft *point, const char *what,
                                  const char *whose) {
    int32_t i = find_body(b, point->body, point->line, what, whose);
    mhe_path_point out = {.body = i < 0 ? GROUND : place[i], .coordinate = {-1, -1, -1}};
    memcpy(out.location, point->location, sizeof out.location);
    if (out.body >= 0 && mirrored[out.body]) {
        out.location[2] = -out.location[2];
    }
    return out;
}

static void place_points(mhi_builder *b, mhe_description *d, const int32_t *place,
                         const int32_t *mirrored) {
    mhe_marker *markers = MHI_TAKE(&b->arena, mhe_marker, b->markers.n);
    mhe_muscle *muscles = MHI_TAKE(&b->arena, mhe_muscle, b->muscles.n);
    mhe_path *paths = MHI_TAKE(&b->arena, mhe_path, b->muscles.n);
    for (int32_t i = 0; markers != NULL && i < b->markers.n; i++) {
        const mhi_marker_draft *draft = MARKER(b, i);
        markers[i].name = draft->name;
        mhe_path_point point =
            place_point(b, place, mirrored, &draft->point, "marker", draft->name);
        markers[i].body = point.body;
        memcpy(markers[i].location, point.location, sizeof markers[i].location);
    }
    for (int32_t i = 0; muscles != NULL && paths != NULL && i < b->muscles.n; i++) {
        const mhi_muscle_draft *draft = MUSCLE(b, i);
        mhe_path_point *points = MHI_TAKE(&b->arena, mhe_path_point, draft->points.n);
        for (int32_t k = 0; points != NULL && k < draft->points.n; k++) {
            points[k] = place_point(b, place, mirrored, draft->points.items[k], "muscle",
                                    draft->muscle.name);
        }
        muscles[i] = draft->muscle;
        muscles[i].line = draft->line;
        paths[i] = (mhe_path){.name = draft->muscle.name,
                              .n_points = points != NULL ? draft->points.n : 0,
                              .points = points,
                              .line = draft->line};
        if (points == NULL && b->status == MHE_OK) {
            b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        }
    }
    if ((markers == NULL || muscles == NULL || paths == NULL) && b->status == MHE_OK) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
    }
    d->markers = markers;
    d->n_markers = b->markers.n;
    d->muscles = muscles;
    d->n_muscles = b->muscles.n;
    d->paths = paths;
    d->n_paths = b->muscles.n;
}

/* "models/arm.osim" -> "arm" */
static const char *base_name(mhi_builder *b) {
    const char *slash = strrchr(b->source, '/');
    const char *start = slash != NULL ? slash + 1 : b->source;
    const char *dot = strrchr(start, '.');
    const char *copy =
        mhi_arena_text_n(&b->arena, start, dot != NULL ? (size_t)(dot - start) : strlen(start));
    return copy != NULL ? copy : "";
}

mhe_status mhi_build_finish(mhi_builder *b, mhe_description **description) {
    *description = NULL;
    mhi_owned_description *owned = calloc(1, sizeof *owned);
    int32_t *place = MHI_TAKE(&b->arena, int32_t, b->bodies.n);
    int32_t *mirrored = MHI_TAKE(&b->arena, int32_t, b->bodies.n);
    if (b->status == MHE_OK && (owned == NULL || place == NULL || mirrored == NULL)) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
    }
    if (b->status == MHE_OK) {
        check_all(b);
    }
    mhe_description *d = owned != NULL ? &owned->description : NULL;
    if (b->status == MHE_OK) {
        place_bodies(b, d, place, mirrored);
    }
    if (b->status == MHE_OK) {
        place_points(b, d, place, mirrored);
    }
    mhi_build_count_kinds(b);
    const char *name = b->name != NULL ? b->name : base_name(b);
    if (b->status != MHE_OK || b->arena.failed) {
        free(owned);
        return mhi_build_abandon(b);
    }
    d->size = sizeof *d;
    d->name = name;
    d->source = b->source;
    memcpy(d->gravity, b->gravity, sizeof d->gravity);
    d->unsupported = (const char *const *)b->unsupported.items;
    d->n_unsupported = b->unsupported.n;
    d->warnings = (const char *const *)b->warnings.items;
    d->n_warnings = b->warnings.n;
    owned->arena = b->arena;
    *description = d;
    return MHE_OK;
}
