/* SPDX-License-Identifier: Apache-2.0 */
/* osim_muscle.c: muscles and their parameters. */
#include "io/osim.h"

#include <math.h>
#include <string.h>

int32_t mhi_osim_is_muscle(const xmlNode *node) {
    return mhi_xml_ends(node, "Muscle") || mhi_xml_ends(node, "Muscle_Deprecated");
}

typedef struct parameter {
    const char *tag;
    double *out;
    double otherwise; /* what OpenSim takes where file and <defaults> are silent; NaN: the muscle
                       * plugin decides */
} parameter;

static void read_all(mhi_osim *o, xmlNode *node, const parameter *table, size_t n,
                     const char *whose) {
    for (size_t i = 0; i < n; i++) {
        (void)mhi_xml_numbers(o, node, table[i].tag, table[i].out, 1);
        if (isnan(*table[i].out) && !isnan(table[i].otherwise)) {
            *table[i].out = table[i].otherwise;
            if (table[i].otherwise != 0) {
                mhi_build_warn(&o->b, mhi_xml_line(node),
                               "muscle '%s' has no %s: OpenSim's default %g taken", whose,
                               table[i].tag, table[i].otherwise);
            }
        }
    }
}

static void read_common(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    const parameter table[] = {{"max_isometric_force", &m->max_isometric_force, 1000},
                               {"optimal_fiber_length", &m->optimal_fiber_length, 0.1},
                               {"tendon_slack_length", &m->tendon_slack_length, 0.2},
                               {"pennation_angle", &m->pennation_angle, NAN},
                               {"pennation_angle_at_optimal", &m->pennation_angle, 0},
                               {"maximum_pennation_angle", &m->maximum_pennation_angle, NAN},
                               {"max_contraction_velocity", &m->max_contraction_velocity, NAN},
                               {"Vmax", &m->max_contraction_velocity, NAN},
                               {"activation_time_constant", &m->activation_time, NAN},
                               {"deactivation_time_constant", &m->deactivation_time, NAN},
                               {"minimum_activation", &m->minimum_activation, NAN},
                               {"fiber_damping", &m->fiber_damping, NAN},
                               {"FmaxMuscleStrain", &m->passive_strain, NAN},
                               {"passive_fiber_strain_at_one_norm_force", &m->passive_strain, NAN},
                               {"KshapePassive", &m->passive_shape, NAN},
                               {"KshapeActive", &m->active_shape, NAN},
                               {"Af", &m->velocity_shape, NAN},
                               {"Flen", &m->max_lengthening_force, NAN},
                               {"FmaxTendonStrain", &m->tendon_strain, NAN},
                               {"tendon_strain_at_one_norm_force", &m->tendon_strain, NAN}};
    read_all(o, node, table, sizeof table / sizeof *table, m->name);
    (void)mhi_xml_bound(o, node, "min_control", &m->min_control);
    (void)mhi_xml_bound(o, node, "max_control", &m->max_control);
    m->ignore_tendon_compliance = mhi_xml_stated_flag(o, node, "ignore_tendon_compliance");
    m->ignore_activation_dynamics = mhi_xml_stated_flag(o, node, "ignore_activation_dynamics");
}

/* The curve object of a Millard muscle: its own child, or that of <defaults>. */
static void read_curve(mhi_osim *o, xmlNode *node, const char *type, const parameter *table,
                       size_t n, const char *whose) {
    xmlNode *curve = mhi_xml_property(node, type);
    if (curve != NULL) {
        read_all(o, curve, table, n, whose);
    }
}

static void read_millard(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    mhe_millard_curves *c = &m->millard;
    const parameter active[] = {
        {"min_norm_active_fiber_length", &c->min_norm_active_fiber_length, NAN},
        {"transition_norm_fiber_length", &c->transition_norm_fiber_length, NAN},
        {"max_norm_active_fiber_length", &c->max_norm_active_fiber_length, NAN},
        {"shallow_ascending_slope", &c->shallow_ascending_slope, NAN},
        {"minimum_value", &c->minimum_value, NAN}};
    const parameter velocity[] = {
        {"concentric_slope_at_vmax", &c->concentric_slope_at_vmax, NAN},
        {"concentric_slope_near_vmax", &c->concentric_slope_near_vmax, NAN},
        {"isometric_slope", &c->isometric_slope, NAN},
        {"eccentric_slope_at_vmax", &c->eccentric_slope_at_vmax, NAN},
        {"eccentric_slope_near_vmax", &c->eccentric_slope_near_vmax, NAN},
        {"max_eccentric_velocity_force_multiplier", &c->max_eccentric_velocity_force_multiplier,
         NAN},
        {"concentric_curviness", &c->concentric_curviness, NAN},
        {"eccentric_curviness", &c->eccentric_curviness, NAN}};
    const parameter passive[] = {
        {"strain_at_zero_force", &c->fiber_strain_at_zero_force, NAN},
        {"strain_at_one_norm_force", &c->fiber_strain_at_one_norm_force, NAN},
        {"stiffness_at_low_force", &c->fiber_stiffness_at_low_force, NAN},
        {"stiffness_at_one_norm_force", &c->fiber_stiffness_at_one_norm_force, NAN},
        {"curviness", &c->fiber_curviness, NAN}};
    const parameter tendon[] = {
        {"strain_at_one_norm_force", &c->tendon_strain_at_one_norm_force, NAN},
        {"stiffness_at_one_norm_force", &c->tendon_stiffness_at_one_norm_force, NAN},
        {"norm_force_at_toe_end", &c->tendon_norm_force_at_toe_end, NAN},
        {"curviness", &c->tendon_curviness, NAN}};
    read_curve(o, node, "ActiveForceLengthCurve", active, sizeof active / sizeof *active, m->name);
    read_curve(o, node, "ForceVelocityCurve", velocity, sizeof velocity / sizeof *velocity,
               m->name);
    read_curve(o, node, "FiberForceLengthCurve", passive, sizeof passive / sizeof *passive,
               m->name);
    read_curve(o, node, "TendonForceLengthCurve", tendon, sizeof tendon / sizeof *tendon, m->name);
}

static void read_acceleration(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    read_millard(o, node, m);
    mhi_build_warn(&o->b, mhi_xml_line(node),
                   "Millard2012AccelerationMuscle '%s' is taken without its fibre mass, as "
                   "Millard2012EquilibriumMuscle",
                   m->name);
}

static void read_degroote(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    (void)mhi_xml_numbers(o, node, "active_force_width_scale", &m->active_shape, 1);
    if (m->active_shape < 1) { /* OpenSim refuses it */
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "muscle '%s': active_force_width_scale %g needs to be at least 1", m->name,
                       m->active_shape);
    }
    if (mhi_xml_flag(o, node, "ignore_passive_fiber_force")) {
        m->passive_strain = INFINITY;
    }
}

/* The SIMM splines that OpenSim takes where a file is silent (Schutte1993Muscle_Deprecated,
 * RigidTendonMuscle). */
static const struct default_curve {
    const char *tag;
    int32_t n;
    double x[21], y[21];
} default_curves[] = {{"active_force_length_curve",
                       21,
                       {-5.307692, -4.307692, -1.923077, -0.884615, -0.269231, 0.230769, 0.461538,
                        0.52725,   0.62875,   0.71875,   0.86125,   1.045,     1.2175,   1.43875,
                        1.5,       1.615385,  2,         2.961538,  3.692308,  5.461538, 9.901902},
                       {0.012188, 0.021899, 0.036466, 0.052493, 0.075312, 0.114158, 0.157859,
                        0.226667, 0.636667, 0.856667, 0.95,     0.993333, 0.77,     0.246667,
                        0.193821, 0.133252, 0.072683, 0.044417, 0.036341, 0.021899, 0.007332}},
                      {"passive_force_length_curve",
                       13,
                       {-5, 0.998, 0.999, 1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.601, 1.602, 5},
                       {0, 0, 0, 0, 0.035, 0.12, 0.26, 0.55, 1.17, 2, 2, 2, 2}},
                      {"tendon_force_length_curve",
                       17,
                       {-10, -0.002, -0.001, 0, 0.00131, 0.00281, 0.00431, 0.00581, 0.00731,
                        0.00881, 0.0103, 0.0118, 0.0123, 9.2, 9.201, 9.202, 20},
                       {0, 0, 0, 0, 0.0108, 0.0257, 0.0435, 0.0652, 0.0915, 0.123, 0.161, 0.208,
                        0.227, 345, 345, 345, 345}}};

/* A curve that stands in the file as a function, or OpenSim's own. */
static void read_file_curve(mhi_osim *o, xmlNode *node, const char *tag, mhe_function *out,
                            const char *whose) {
    if (mhi_osim_function_of(o, node, tag, whose, out) != 0) {
        return;
    }
    for (size_t i = 0; i < sizeof default_curves / sizeof *default_curves; i++) {
        const struct default_curve *c = &default_curves[i];
        if (strcmp(c->tag, tag) == 0) {
            *out = mhi_function_spline(&o->b, c->x, c->y, c->n);
            return;
        }
    }
    mhi_build_unsupported(&o->b, mhi_xml_line(node), "muscle '%s' states no %s: it has none", whose,
                          tag);
}

/* Schutte's activation: rate (e - a)(k1 e + k2) / time_scale rising, (e - a) k2 / time_scale
 * falling: time constants at full excitation and of the decay. */
static void read_schutte(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    double scale = 0.1, k1 = 7.667, k2 = 1.459854, damping = 0.1;
    (void)mhi_xml_numbers(o, node, "time_scale", &scale, 1);
    (void)mhi_xml_numbers(o, node, "activation1", &k1, 1);
    (void)mhi_xml_numbers(o, node, "activation2", &k2, 1);
    (void)mhi_xml_numbers(o, node, "damping", &damping, 1);
    if (!(scale > 0 && k1 >= 0 && k2 >= 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "muscle '%s': time_scale %g needs to be > 0, activation1 %g and activation2 "
                       "%g at least 0",
                       m->name, scale, k1, k2);
        return;
    }
    if (k2 > 0) {
        m->activation_time = scale / (k1 + k2);
        m->deactivation_time = scale / k2;
    } else { /* its activation would never fall, without k1 never change */
        mhi_build_warn(&o->b, mhi_xml_line(node),
                       "muscle '%s' has activation2 0, with which no activation ever falls: the "
                       "muscle plugin's own times are taken",
                       m->name);
    }
    m->fiber_damping = damping;
    m->max_contraction_velocity = 1 / scale;
    read_file_curve(o, node, "active_force_length_curve", &m->active_force_length, m->name);
    /* without one OpenSim takes an exponential, and so does the muscle plugin */
    (void)mhi_osim_function_of(o, node, "passive_force_length_curve", m->name,
                               &m->passive_force_length);
    read_file_curve(o, node, "tendon_force_length_curve", &m->tendon_force_length, m->name);
}

static void read_rigid(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    read_file_curve(o, node, "active_force_length_curve", &m->active_force_length, m->name);
    read_file_curve(o, node, "passive_force_length_curve", &m->passive_force_length, m->name);
    read_file_curve(o, node, "force_velocity_curve", &m->force_velocity, m->name);
}

/* The curves of the muscle's type. */
static void read_type(mhi_osim *o, xmlNode *node, mhe_muscle *m) {
    static const struct {
        const char *tag;
        int32_t type;
        void (*read)(mhi_osim *, xmlNode *, mhe_muscle *);
    } types[] = {{"Thelen2003Muscle", MHE_MUSCLE_THELEN2003, NULL},
                 {"Millard2012EquilibriumMuscle", MHE_MUSCLE_MILLARD2012, read_millard},
                 {"Millard2012AccelerationMuscle", MHE_MUSCLE_MILLARD2012, read_acceleration},
                 {"DeGrooteFregly2016Muscle", MHE_MUSCLE_DEGROOTE2016, read_degroote},
                 {"Schutte1993Muscle_Deprecated", MHE_MUSCLE_SCHUTTE1993, read_schutte},
                 {"Schutte1993Muscle", MHE_MUSCLE_SCHUTTE1993, read_schutte},
                 {"RigidTendonMuscle", MHE_MUSCLE_RIGID, read_rigid}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (mhi_xml_is(node, types[i].tag)) {
            m->type = types[i].type;
            if (types[i].read != NULL) {
                types[i].read(o, node, m);
            }
            return;
        }
    }
    mhi_build_unsupported(&o->b, mhi_xml_line(node),
                          "the curves of %s '%s': those of the muscle plugin's own choice act",
                          (const char *)node->name, m->name);
}

void mhi_osim_muscle(mhi_osim *o, xmlNode *node) {
    const char *name = mhi_xml_name(o, node);
    mhi_path_draft path;
    if (!mhi_osim_path(o, node, "muscle", &path)) {
        return;
    }
    mhi_muscle_draft *draft = mhi_build_muscle(&o->b, name, mhi_xml_line(node));
    if (draft != NULL) {
        draft->path = path;
        read_common(o, node, &draft->muscle);
        if (draft->muscle.max_contraction_velocity == 0) { /* OpenSim loads it; it cannot move */
            mhi_build_warn(&o->b, draft->line,
                           "muscle '%s' has max_contraction_velocity 0: the default is taken",
                           name);
            draft->muscle.max_contraction_velocity = NAN;
        }
        read_type(o, node, &draft->muscle);
    }
}
