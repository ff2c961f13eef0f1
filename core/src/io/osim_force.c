/* SPDX-License-Identifier: Apache-2.0 */
/* osim_force.c: muscles and their paths; every other force is listed as unsupported. */
#include "io/osim.h"

#include <math.h>
#include <string.h>

typedef struct path {
    mhi_list points;  /* mhi_point_draft */
    int32_t left_out; /* points of kinds that cannot be said */
} path;

static int32_t ends_with(const char *text, const char *ending) {
    size_t n = strlen(text), k = strlen(ending);
    return n >= k && strcmp(text + n - k, ending) == 0;
}

static int32_t is_muscle(const xmlNode *node) {
    const char *type = (const char *)node->name;
    return ends_with(type, "Muscle") || ends_with(type, "Muscle_Deprecated");
}

static void read_path(mhi_osim *o, xmlNode *geometry, const char *muscle, path *out) {
    for (xmlNode *n = mhi_xml_objects(o, geometry, "PathPointSet"); n != NULL;
         n = mhi_xml_next(n)) {
        if (!mhi_xml_is(n, "PathPoint")) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "%s '%s' of muscle '%s'",
                                  (const char *)n->name, mhi_xml_name(o, n), muscle);
            out->left_out++;
            continue;
        }
        mhi_point_draft *point = mhi_build_push(&o->b, &out->points, sizeof *point);
        if (point == NULL || !mhi_osim_location(o, n, &point->body, point->location)) {
            return;
        }
        point->line = mhi_xml_line(n);
    }
    for (xmlNode *n = mhi_xml_objects(o, geometry, "PathWrapSet"); n != NULL; n = mhi_xml_next(n)) {
        const char *object = mhi_xml_word(o, n, "wrap_object");
        mhi_build_unsupported(&o->b, mhi_xml_line(n), "%s of muscle '%s' around '%s'",
                              (const char *)n->name, muscle, object != NULL ? object : "?");
    }
}

static int32_t muscle_type(mhi_osim *o, const xmlNode *node, const char *name) {
    static const struct {
        const char *tag;
        int32_t type;
    } types[] = {{"Thelen2003Muscle", MHE_MUSCLE_THELEN2003},
                 {"Millard2012EquilibriumMuscle", MHE_MUSCLE_MILLARD2012},
                 {"DeGrooteFregly2016Muscle", MHE_MUSCLE_DEGROOTE2016}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (mhi_xml_is(node, types[i].tag)) {
            return types[i].type;
        }
    }
    mhi_build_unsupported(&o->b, mhi_xml_line(node), "the curves of %s '%s'",
                          (const char *)node->name, name);
    return MHE_MUSCLE_UNSTATED;
}

static void read_parameters(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    const struct {
        const char *tag;
        double *out;
        double otherwise; /* what OpenSim takes where file and <defaults> are silent */
    } table[] = {{"max_isometric_force", &m->max_isometric_force, 1000},
                 {"optimal_fiber_length", &m->optimal_fiber_length, 0.1},
                 {"tendon_slack_length", &m->tendon_slack_length, 0.2},
                 {"pennation_angle", &m->pennation_angle, NAN},
                 {"pennation_angle_at_optimal", &m->pennation_angle, 0},
                 {"max_contraction_velocity", &m->max_contraction_velocity, NAN},
                 {"activation_time_constant", &m->activation_time, NAN},
                 {"deactivation_time_constant", &m->deactivation_time, NAN},
                 {"fiber_damping", &m->fiber_damping, NAN},
                 {"FmaxMuscleStrain", &m->passive_strain, NAN},
                 {"passive_fiber_strain_at_one_norm_force", &m->passive_strain, NAN},
                 {"KshapePassive", &m->passive_shape, NAN},
                 {"KshapeActive", &m->active_shape, NAN},
                 {"Af", &m->velocity_shape, NAN},
                 {"Flen", &m->max_lengthening_force, NAN}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        (void)mhi_xml_numbers(o, node, table[i].tag, table[i].out, 1);
        if (isnan(*table[i].out) && !isnan(table[i].otherwise)) {
            *table[i].out = table[i].otherwise;
            if (table[i].otherwise != 0) {
                mhi_build_warn(&o->b, mhi_xml_line(node),
                               "muscle '%s' has no %s: OpenSim's default %g taken", m->name,
                               table[i].tag, table[i].otherwise);
            }
        }
    }
}

static void read_muscle(mhi_osim *o, xmlNode *node) {
    const char *name = mhi_xml_name(o, node);
    int32_t line = mhi_xml_line(node);
    path route = {0};
    xmlNode *geometry = mhi_xml_child(node, "GeometryPath");
    xmlNode *other = mhi_xml_child(node, "FunctionBasedPath");
    if (geometry == NULL && other != NULL) {
        mhi_build_unsupported(&o->b, mhi_xml_line(other), "FunctionBasedPath of muscle '%s'", name);
        return;
    }
    if (geometry == NULL) {
        mhi_build_fail(&o->b, line, "muscle '%s' has no GeometryPath", name);
        return;
    }
    read_path(o, geometry, name, &route);
    if (route.left_out > 0 && route.points.n < 2) {
        mhi_build_warn(&o->b, line,
                       "muscle '%s' skipped: without its unsupported points no path "
                       "is left",
                       name);
        return;
    }
    mhi_muscle_draft *draft = mhi_build_muscle(&o->b, name, line);
    if (draft != NULL) {
        draft->points = route.points;
        draft->muscle.type = muscle_type(o, node, name);
        read_parameters(o, node, &draft->muscle);
    }
}

void mhi_osim_forces(mhi_osim *o) {
    for (xmlNode *n = mhi_xml_objects(o, o->model, "ForceSet"); n != NULL; n = mhi_xml_next(n)) {
        const char *applies = mhi_xml_word(o, n, "appliesForce");
        if (mhi_xml_flag(o, n, "isDisabled") ||
            (applies != NULL && mhi_same_word(applies, "false"))) {
            mhi_build_warn(&o->b, mhi_xml_line(n), "%s '%s' is switched off: skipped",
                           (const char *)n->name, mhi_xml_name(o, n));
        } else if (is_muscle(n)) {
            read_muscle(o, n);
        } else {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "%s '%s'", (const char *)n->name,
                                  mhi_xml_name(o, n));
        }
    }
}
