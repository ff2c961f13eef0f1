/* SPDX-License-Identifier: Apache-2.0 */
/* description_check.c: what no mechanics could use is refused: names given twice, unknown bodies,
 * masses, ranges and muscles that cannot be. */
#include "base/text.h"
#include "io/description_builder.h"

#include <math.h>
#include <string.h>

#define BODY(b, i) ((mhi_body_draft *)(b)->bodies.items[i])
#define COORDINATE(b, i) ((mhi_coordinate_draft *)(b)->coordinates.items[i])
#define MARKER(b, i) ((mhi_marker_draft *)(b)->markers.items[i])
#define MUSCLE(b, i) ((mhi_muscle_draft *)(b)->muscles.items[i])
#define GROUND (-1)
#define TURNS 10.0         /* rad: no joint turns further */
#define MOST_DEGREES 720.0 /* larger numbers say "without end" */
#define ROUNDED 1e-6
#define FAR 20.0    /* m */
#define LONGEST 3.0 /* m of fibre or tendon: no animal has more (a giraffe's leg) */
#define HEAVY 30.0  /* m/s2: no planet that people stand on */

int32_t mhi_build_find_body(mhi_builder *b, const char *name, int32_t line, const char *what,
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
    if (*name == '\0') {
        mhi_build_fail(b, line, "this %s has no name", what);
    }
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
        check_name(b, "marker", marker->name, marker->point.line);
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
        mhi_build_warn(b, draft->line,
                       "the inertia of body '%s' is not positive about every axis: kept, as "
                       "OpenSim does",
                       body->name);
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
        {"fibre damping", m->fiber_damping, m->fiber_damping < 0},
        {"passive strain", m->passive_strain, m->passive_strain <= 0},
        {"passive shape", m->passive_shape, m->passive_shape <= 0},
        {"active shape", m->active_shape, m->active_shape <= 0},
        {"force-velocity shape", m->velocity_shape, m->velocity_shape <= 0},
        {"maximal lengthening force", m->max_lengthening_force, m->max_lengthening_force <= 1},
        {"tendon strain", m->tendon_strain, m->tendon_strain <= 0},
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
}

/* Lengths that are some, but of no muscle. */
static void warn_long(mhi_builder *b, const mhi_muscle_draft *draft) {
    const mhe_muscle *m = &draft->muscle;
    if (m->optimal_fiber_length > LONGEST || m->tendon_slack_length > LONGEST) {
        mhi_build_warn(b, draft->line,
                       "muscle '%s' has fibres of %g m and a tendon of %g m; are they in mm?",
                       m->name, m->optimal_fiber_length, m->tendon_slack_length);
    }
}

static void check_gravity(mhi_builder *b) {
    const double g = hypot(hypot(b->gravity[0], b->gravity[1]), b->gravity[2]);
    if (g > HEAVY || fabs(g - 1) < 0.1) {
        mhi_build_warn(b, 0, "gravity is %g m/s2; is it in %s?", g,
                       g < HEAVY         ? "parts of 9.81 m/s2"
                       : g < 100 * HEAVY ? "cm/s2"
                                         : "mm/s2");
    }
}

void mhi_build_warn_degrees(mhi_builder *b, int32_t line, const char *whose,
                            const mhe_coordinate *coordinate, const double range[2]) {
    const double largest = fmax(fabs(range[0]), fabs(range[1]));
    if (coordinate->rotational && largest > TURNS && largest <= MOST_DEGREES) {
        mhi_build_warn(b, line, "%s: its range is taken as %g to %g rad; is it in degrees?", whose,
                       range[0], range[1]);
    }
}

static void check_coordinate(mhi_builder *b, const mhi_coordinate_draft *draft) {
    const mhe_coordinate *c = &draft->coordinate;
    const double range[2] = {c->lower, c->upper};
    const char *whose = mhi_arena_format(&b->arena, "coordinate '%s'", c->name);
    if (!(c->lower <= c->upper)) {
        mhi_build_fail(b, draft->line,
                       "the range of coordinate '%s' ends (%g) before it begins (%g)", c->name,
                       c->upper, c->lower);
        return;
    }
    mhi_build_warn_degrees(b, draft->line, whose != NULL ? whose : "", c, range);
    if (!draft->locked && (c->value < c->lower - ROUNDED || c->value > c->upper + ROUNDED)) {
        mhi_build_warn(b, draft->line,
                       "coordinate '%s' has the default %g, which its range of %g to %g excludes",
                       c->name, c->value, c->lower, c->upper);
    }
}

/* Lengths are in m; what lies across the street was written in mm. */
static void warn_far(mhi_builder *b, int32_t line, const char *what, const char *name,
                     const double at[3]) {
    const double far = hypot(hypot(at[0], at[1]), at[2]);
    if (far > FAR) {
        mhi_build_warn(b, line, "%s '%s' lies %g m from its frame; is it in mm?", what, name, far);
    }
}

static void check_places(mhi_builder *b) {
    for (int32_t i = 0; i < b->bodies.n; i++) {
        const mhi_body_draft *draft = BODY(b, i);
        warn_far(b, draft->line, "the mass centre of body", draft->body.name, draft->body.com);
        warn_far(b, draft->line, "the joint of body", draft->body.name, draft->body.joint_p);
        warn_far(b, draft->line, "the joint's frame in body", draft->body.name, draft->body.body_p);
    }
    for (int32_t i = 0; i < b->markers.n; i++) {
        const mhi_marker_draft *draft = MARKER(b, i);
        warn_far(b, draft->point.line, "marker", draft->name, draft->point.point.location);
    }
    for (int32_t i = 0; i < b->muscles.n; i++) {
        const mhi_path_draft *path = &MUSCLE(b, i)->path;
        for (int32_t k = 0; k < path->points.n; k++) {
            const mhi_point_draft *draft = path->points.items[k];
            warn_far(b, draft->line, "a point of muscle", path->name, draft->point.location);
        }
    }
}

void mhi_build_check_bodies(mhi_builder *b) {
    check_unique(b, "body", b->bodies.n, body_name);
}

void mhi_build_check(mhi_builder *b) {
    mhi_build_check_bodies(b);
    check_unique(b, "coordinate", b->coordinates.n, coordinate_name);
    drop_double_markers(b);
    check_unique(b, "muscle", b->muscles.n, muscle_name);
    for (int32_t i = 0; i < b->bodies.n; i++) {
        mhi_build_check_rotation(b, BODY(b, i), BODY(b, i)->body.joint_r);
        mhi_build_check_rotation(b, BODY(b, i), BODY(b, i)->body.body_r);
        check_inertia(b, BODY(b, i));
    }
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        check_coordinate(b, COORDINATE(b, i));
    }
    for (int32_t i = 0; i < b->muscles.n; i++) {
        check_muscle(b, MUSCLE(b, i));
        warn_long(b, MUSCLE(b, i));
    }
    check_gravity(b);
    check_places(b);
}
