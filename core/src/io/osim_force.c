/* SPDX-License-Identifier: Apache-2.0 */
/* osim_force.c: forces other than muscles. */
#include "io/osim.h"

#include "base/pi.h"

#include <math.h>
#include <string.h>

/* The coordinate that a force names; -1 after an error. */
static int32_t force_coordinate(mhi_osim *o, xmlNode *node) {
    const char *name = mhi_xml_word(o, node, "coordinate");
    const char *whose =
        mhi_arena_format(&o->b.arena, "%s '%s'", (const char *)node->name, mhi_xml_name(o, node));
    if (name == NULL || whose == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s names no coordinate",
                       whose != NULL ? whose : "");
        return -1;
    }
    return mhi_osim_coordinate(o, name, mhi_xml_line(node), whose);
}

/* Limits of rotations are written in degrees, their stiffnesses per degree. */
static void read_limit(mhi_osim *o, xmlNode *node) {
    int32_t coordinate = force_coordinate(o, node);
    if (coordinate < 0) {
        return;
    }
    mhe_coordinate_limit l = {
        .name = mhi_xml_name(o, node), .coordinate = coordinate, .transition = 0.1};
    (void)mhi_xml_numbers(o, node, "upper_limit", &l.upper, 1);
    (void)mhi_xml_numbers(o, node, "lower_limit", &l.lower, 1);
    (void)mhi_xml_numbers(o, node, "upper_stiffness", &l.upper_stiffness, 1);
    (void)mhi_xml_numbers(o, node, "lower_stiffness", &l.lower_stiffness, 1);
    (void)mhi_xml_numbers(o, node, "damping", &l.damping, 1);
    (void)mhi_xml_numbers(o, node, "transition", &l.transition, 1);
    const mhi_coordinate_draft *draft = o->b.coordinates.items[coordinate];
    if (draft->coordinate.rotational) {
        const double degree = MHI_PI / 180;
        l.upper *= degree;
        l.lower *= degree;
        l.transition *= degree;
        l.upper_stiffness /= degree;
        l.lower_stiffness /= degree;
        l.damping /= degree;
    }
    if (!(l.lower <= l.upper) || !(l.transition > 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "CoordinateLimitForce '%s' needs lower_limit <= upper_limit and a "
                       "transition > 0",
                       l.name);
        return;
    }
    mhe_coordinate_limit *out = mhi_build_push(&o->b, &o->b.limits, sizeof *out);
    if (out != NULL) {
        *out = l;
    }
}

static void read_coordinate_spring(mhi_osim *o, xmlNode *node) {
    int32_t coordinate = force_coordinate(o, node);
    mhe_coordinate_spring *out =
        coordinate < 0 ? NULL : mhi_build_push(&o->b, &o->b.coordinate_springs, sizeof *out);
    if (out != NULL) {
        out->name = mhi_xml_name(o, node);
        out->coordinate = coordinate;
        (void)mhi_xml_numbers(o, node, "stiffness", &out->stiffness, 1);
        (void)mhi_xml_numbers(o, node, "rest_length", &out->rest, 1);
        (void)mhi_xml_numbers(o, node, "viscosity", &out->viscosity, 1);
    }
}

static void read_path_spring(mhi_osim *o, xmlNode *node) {
    mhi_path_spring_draft draft = {.spring = {0}};
    if (!mhi_osim_path(o, node, "spring", &draft.path)) {
        return;
    }
    (void)mhi_xml_numbers(o, node, "stiffness", &draft.spring.stiffness, 1);
    (void)mhi_xml_numbers(o, node, "resting_length", &draft.spring.rest, 1);
    (void)mhi_xml_numbers(o, node, "dissipation", &draft.spring.dissipation, 1);
    mhi_path_spring_draft *out = mhi_build_push(&o->b, &o->b.path_springs, sizeof *out);
    if (out != NULL) {
        *out = draft;
    }
}

static void read_point_spring(mhi_osim *o, xmlNode *node) {
    const char *body[2];
    mhi_transform frame[2];
    double at[2][3] = {{0}};
    if (!mhi_osim_two_frames(o, node, "/forceset", "body", "body", body, frame)) {
        return;
    }
    (void)mhi_xml_numbers(o, node, "point1", at[0], 3);
    (void)mhi_xml_numbers(o, node, "point2", at[1], 3);
    mhi_path_spring_draft *out = mhi_build_push(&o->b, &o->b.path_springs, sizeof *out);
    if (out == NULL) {
        return;
    }
    out->spring.pushes = 1;
    out->path.what = "spring";
    out->path.name = mhi_xml_name(o, node);
    out->path.line = mhi_xml_line(node);
    (void)mhi_xml_numbers(o, node, "stiffness", &out->spring.stiffness, 1);
    (void)mhi_xml_numbers(o, node, "rest_length", &out->spring.rest, 1);
    for (int k = 0; k < 2; k++) {
        mhi_point_draft *point = mhi_build_push(&o->b, &out->path.points, sizeof *point);
        if (point != NULL) {
            point->body = body[k];
            point->line = out->path.line;
            point->point = (mhe_path_point){.coordinate = {-1, -1, -1}};
            mhi_transform_point(&frame[k], at[k], point->point.location);
        }
    }
}

static void read_ligament(mhi_osim *o, xmlNode *node) {
    /* OpenSim's curve where the file has none (Ligament: force over length by rest length) */
    static const double x[] = {-5, 0.998, 0.999, 1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.601, 1.602, 5};
    static const double y[] = {0, 0, 0, 0, 0.035, 0.12, 0.26, 0.55, 1.17, 2, 2, 2, 2};
    const char *name = mhi_xml_name(o, node);
    mhi_ligament_draft draft = {.ligament = {0}};
    if (!mhi_osim_path(o, node, "ligament", &draft.path)) {
        return;
    }
    (void)mhi_xml_numbers(o, node, "resting_length", &draft.ligament.rest, 1);
    (void)mhi_xml_numbers(o, node, "pcsa_force", &draft.ligament.scale, 1);
    if (!(draft.ligament.rest > 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "ligament '%s' needs a resting_length > 0, not %g", name,
                       draft.ligament.rest);
        return;
    }
    int32_t found =
        mhi_osim_function_of(o, node, "force_length_curve", name, &draft.ligament.curve);
    if (found == 0) {
        draft.ligament.curve = mhi_function_spline(&o->b, x, y, sizeof x / sizeof *x);
    }
    mhi_ligament_draft *out =
        found < 0 ? NULL : mhi_build_push(&o->b, &o->b.ligaments, sizeof *out);
    if (out != NULL) {
        *out = draft;
    }
}

/* Blankevoort & Huiskes (1991), doi:10.1115/1.2894883: over the strain e of the slack length no
 * force, up to the transition strain t stiffness e^2 / (2 t), then stiffness (e - t / 2). */
static mhe_function blankevoort_curve(mhi_osim *o, double stiffness, double transition) {
    double *numbers = mhi_build_take(&o->b, 12, sizeof *numbers);
    if (numbers == NULL) {
        return (mhe_function){0};
    }
    double *origin = numbers, *coef = numbers + 3;
    origin[0] = origin[1] = 1;
    origin[2] = 1 + transition;
    if (transition > 0) {
        coef[5] = stiffness / (2 * transition);
    }
    coef[6] = stiffness * transition / 2;
    coef[7] = stiffness;
    return (mhe_function){.origin = origin, .coef = coef, .n_pieces = 3, .n_coef = 3};
}

/* Its damping is a force of `damping_coefficient` per unit of strain rate, while it is taut and
 * lengthens: next to nothing in every public model (0.003 N s), and left out there. */
static void read_blankevoort(mhi_osim *o, xmlNode *node) {
    double stiffness = 1, transition = 0.06, damping = 0.003;
    mhi_ligament_draft draft = {.ligament = {.scale = 1}};
    if (!mhi_osim_path(o, node, "ligament", &draft.path)) {
        return;
    }
    (void)mhi_xml_numbers(o, node, "slack_length", &draft.ligament.rest, 1);
    (void)mhi_xml_numbers(o, node, "linear_stiffness", &stiffness, 1);
    (void)mhi_xml_numbers(o, node, "transition_strain", &transition, 1);
    (void)mhi_xml_numbers(o, node, "damping_coefficient", &damping, 1);
    if (!(draft.ligament.rest > 0 && stiffness >= 0 && transition >= 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "ligament '%s' needs a slack_length > 0 (has %g), linear_stiffness and "
                       "transition_strain of at least 0 (%g, %g)",
                       mhi_xml_name(o, node), draft.ligament.rest, stiffness, transition);
        return;
    }
    if (damping > 1e-3 * stiffness) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node),
                              "damping_coefficient %g of ligament '%s': it is not damped", damping,
                              mhi_xml_name(o, node));
    }
    draft.ligament.curve = blankevoort_curve(o, stiffness, transition);
    mhi_ligament_draft *out = mhi_build_push(&o->b, &o->b.ligaments, sizeof *out);
    if (out != NULL) {
        *out = draft;
    }
}

static void read_bushing(mhi_osim *o, xmlNode *node) {
    const char *body[2];
    mhi_transform frame[2];
    if (!mhi_osim_two_frames(o, node, "/forceset", "frame", "body_", body, frame)) {
        return;
    }
    mhi_bushing_draft *out = mhi_build_push(&o->b, &o->b.bushings, sizeof *out);
    if (out == NULL) {
        return;
    }
    mhe_bushing *b = &out->bushing;
    b->name = mhi_xml_name(o, node);
    out->line = mhi_xml_line(node);
    for (int k = 0; k < 2; k++) {
        out->body[k] = body[k];
        memcpy(b->r[k], frame[k].r, sizeof frame[k].r);
        memcpy(b->p[k], frame[k].p, sizeof frame[k].p);
    }
    (void)mhi_xml_numbers(o, node, "rotational_stiffness", b->rotational_stiffness, 3);
    (void)mhi_xml_numbers(o, node, "translational_stiffness", b->translational_stiffness, 3);
    (void)mhi_xml_numbers(o, node, "rotational_damping", b->rotational_damping, 3);
    (void)mhi_xml_numbers(o, node, "translational_damping", b->translational_damping, 3);
}

/* ---- actuators ---- */

static mhi_actuator_draft *new_actuator(mhi_osim *o, xmlNode *node, int32_t kind) {
    mhi_actuator_draft *out = mhi_build_push(&o->b, &o->b.actuators, sizeof *out);
    if (out != NULL) {
        out->line = mhi_xml_line(node);
        out->actuator = (mhe_actuator){.name = mhi_xml_name(o, node),
                                       .kind = kind,
                                       .coordinate = -1,
                                       .optimal_force = 1,
                                       .min_control = NAN,
                                       .max_control = NAN};
        (void)mhi_xml_numbers(o, node, "optimal_force", &out->actuator.optimal_force, 1);
        (void)mhi_xml_bound(o, node, "min_control", &out->actuator.min_control);
        (void)mhi_xml_bound(o, node, "max_control", &out->actuator.max_control);
    }
    return out;
}

static void read_coordinate_actuator(mhi_osim *o, xmlNode *node) {
    int32_t coordinate = force_coordinate(o, node);
    mhi_actuator_draft *out =
        coordinate < 0 ? NULL : new_actuator(o, node, MHE_ACTUATOR_COORDINATE);
    if (out != NULL) {
        out->actuator.coordinate = coordinate;
    }
}

/* A body by its name, or a path that ends in one. */
static void actuator_body(mhi_osim *o, xmlNode *node, const char *tag, const char **body) {
    mhi_transform place;
    const char *name = mhi_xml_word(o, node, tag);
    if (name == NULL || mhi_same_word(name, "Unassigned")) {
        *body = NULL; /* ground */
    } else {
        (void)mhi_osim_resolve(o, name, "", mhi_xml_line(node), body, &place);
    }
}

static void read_axis(mhi_osim *o, xmlNode *node, const char *tag, mhe_actuator *a) {
    double norm;
    (void)mhi_xml_numbers(o, node, tag, a->axis, 3);
    norm = hypot(hypot(a->axis[0], a->axis[1]), a->axis[2]);
    if (!(norm > 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "<%s> of '%s' has no length", tag, a->name);
        return;
    }
    for (int k = 0; k < 3; k++) {
        a->axis[k] /= norm;
    }
}

static void read_torque_actuator(mhi_osim *o, xmlNode *node) {
    mhi_actuator_draft *out = new_actuator(o, node, MHE_ACTUATOR_TORQUE);
    if (out == NULL) {
        return;
    }
    out->actuator.axis[2] = 1;
    out->actuator.axis_in_ground = mhi_xml_stated_flag(o, node, "torque_is_global") != 0;
    actuator_body(o, node, "bodyA", &out->body[0]);
    actuator_body(o, node, "bodyB", &out->body[1]);
    read_axis(o, node, "axis", &out->actuator);
}

static void read_point_actuator(mhi_osim *o, xmlNode *node) {
    if (mhi_xml_flag(o, node, "point_is_global")) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node),
                              "PointActuator '%s' at a point of ground: it is left out",
                              mhi_xml_name(o, node));
        return;
    }
    mhi_actuator_draft *out = new_actuator(o, node, MHE_ACTUATOR_POINT);
    if (out == NULL) {
        return;
    }
    out->actuator.axis[2] = 1;
    out->actuator.axis_in_ground = mhi_xml_flag(o, node, "force_is_global");
    actuator_body(o, node, "body", &out->body[0]);
    (void)mhi_xml_numbers(o, node, "point", out->actuator.point, 3);
    read_axis(o, node, "direction", &out->actuator);
}

/* ---- all of them ---- */

int32_t mhi_osim_force(mhi_osim *o, xmlNode *node) {
    static const struct {
        const char *tag;
        void (*read)(mhi_osim *, xmlNode *);
    } kinds[] = {{"CoordinateLimitForce", read_limit},
                 {"SpringGeneralizedForce", read_coordinate_spring},
                 {"PathSpring", read_path_spring},
                 {"PointToPointSpring", read_point_spring},
                 {"Ligament", read_ligament},
                 {"Blankevoort1991Ligament", read_blankevoort},
                 {"BushingForce", read_bushing},
                 {"CoordinateActuator", read_coordinate_actuator},
                 {"GeneralizedForce", read_coordinate_actuator},
                 {"ActivationCoordinateActuator", read_coordinate_actuator},
                 {"TorqueActuator", read_torque_actuator},
                 {"Torque", read_torque_actuator},
                 {"PointActuator", read_point_actuator},
                 {"Force", read_point_actuator}};
    static const char *const forward[] = {
        "HuntCrossleyForce",    "ElasticFoundationForce",  "SmoothSphereHalfSpaceForce",
        "MeyerFregly2016Force", "ExponentialContactForce", "ExponentialContact",
        "PrescribedForce",      "ExternalForce",           "ExternalLoads"};
    size_t kind = 0;
    while (kind < sizeof kinds / sizeof *kinds && !mhi_xml_is(node, kinds[kind].tag)) {
        kind++;
    }
    const int32_t read = kind < sizeof kinds / sizeof *kinds, muscle = mhi_osim_is_muscle(node);
    const int32_t in_forward = mhi_xml_one_of(node, forward, sizeof forward / sizeof *forward);
    if (!read && !muscle && !in_forward) {
        return 0;
    }
    if (!mhi_xml_enabled(o, node)) {
        mhi_build_warn(&o->b, mhi_xml_line(node), "%s '%s' is switched off: skipped",
                       (const char *)node->name, mhi_xml_name(o, node));
    } else if (muscle) {
        mhi_osim_muscle(o, node);
    } else if (read) {
        kinds[kind].read(o, node);
    } else {
        mhi_build_dropped(&o->b, mhi_xml_line(node),
                          "%s '%s': contact and prescribed forces act in a forward simulation "
                          "only; measured loads come with the recording",
                          (const char *)node->name, mhi_xml_name(o, node));
    }
    return 1;
}

void mhi_osim_forces(mhi_osim *o) {
    for (xmlNode *n = mhi_xml_objects(o->model, "ForceSet"); n != NULL && o->b.status == MHE_OK;
         n = mhi_xml_next(n)) {
        if (!mhi_osim_force(o, n) && mhi_xml_enabled(o, n)) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "%s '%s': its force is missing",
                                  (const char *)n->name, mhi_xml_name(o, n));
        }
    }
}
