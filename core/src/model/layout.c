/* SPDX-License-Identifier: Apache-2.0 */
/* layout.c: the table of blocks of a system, and all sizes that follow from it. */
#include "model/system_private.h"

#include <math.h>
#include <string.h>

/* Usual sizes, for scaling. */
#define USUAL_ANGLE 1.0   /* rad */
#define USUAL_LENGTH 0.1  /* m */
#define USUAL_RATE 10.0   /* of both, 1/s */
#define USUAL_TORQUE 10.0 /* N m */
#define USUAL_FORCE 100.0 /* N */

/* What is known of a block's entries; all arrays are the block's to be. */
typedef struct entries {
    const char **names;
    const char **units;
    int32_t *owner;
    double *lower, *upper, *scale;
} entries;

typedef struct maker {
    mhi_system *s;
    const mhi_system_setup *setup;
    mhe_block *blocks;
    int32_t n_blocks;
    int32_t n[4]; /* entries of each role */
} maker;

/* The next block of a role; its entries are for the caller to fill: no bounds, scale 1, no owner.
 * 0: out of memory. */
static int begin(maker *m, const char *name, int32_t role, int32_t structure, int32_t n,
                 entries *e) {
    mhi_arena *arena = &m->s->arena;
    *e = (entries){MHI_TAKE(arena, const char *, n), MHI_TAKE(arena, const char *, n),
                   MHI_TAKE(arena, int32_t, n),      MHI_TAKE(arena, double, n),
                   MHI_TAKE(arena, double, n),       MHI_TAKE(arena, double, n)};
    if (!e->names || !e->units || !e->owner || !e->lower || !e->upper || !e->scale) {
        return 0;
    }
    for (int32_t i = 0; i < n; i++) {
        e->owner[i] = -1;
        e->lower[i] = -INFINITY;
        e->upper[i] = INFINITY;
        e->scale[i] = 1;
    }
    m->blocks[m->n_blocks++] = (mhe_block){.name = name,
                                           .role = role,
                                           .structure = structure,
                                           .first = m->n[role],
                                           .count = n,
                                           .entry_names = e->names,
                                           .units = e->units,
                                           .owner = e->owner,
                                           .lower = e->lower,
                                           .upper = e->upper,
                                           .scale = e->scale};
    m->n[role] += n;
    return 1;
}

static int coordinate_block(maker *m, const char *name, int32_t role, const char *const unit[2],
                            const double scale[2], entries *e) {
    const mhe_description *d = m->s->description;
    if (!begin(m, name, role, MHE_STRUCTURE_DENSE, d->n_coordinates, e)) {
        return 0;
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const int32_t kind = d->coordinates[i].rotational ? 0 : 1;
        e->names[i] = d->coordinates[i].name;
        e->units[i] = unit[kind];
        e->owner[i] = i;
        e->scale[i] = scale[kind];
    }
    return 1;
}

static int positions(maker *m) {
    static const char *const q_unit[] = {"rad", "m"}, *const v_unit[] = {"rad/s", "m/s"};
    static const double q_scale[] = {USUAL_ANGLE, USUAL_LENGTH};
    static const double v_scale[] = {USUAL_ANGLE * USUAL_RATE, USUAL_LENGTH * USUAL_RATE};
    const mhe_description *d = m->s->description;
    const mhi_bounds *b = m->setup->bounds;
    entries q, v;
    if (!coordinate_block(m, "q", MHE_ROLE_STATE, q_unit, q_scale, &q) ||
        !coordinate_block(m, "qdot", MHE_ROLE_STATE, v_unit, v_scale, &v)) {
        return 0;
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        q.lower[i] = d->coordinates[i].lower;
        q.upper[i] = d->coordinates[i].upper;
        v.lower[i] = b != NULL ? -b->velocity_max : -INFINITY;
        v.upper[i] = b != NULL ? b->velocity_max : INFINITY;
    }
    return 1;
}

/* One entry a muscle, within [low, high]. */
static int muscle_block(maker *m, const char *name, int32_t role, int32_t structure, double low,
                        double high, entries *e) {
    const mhe_description *d = m->s->description;
    if (!begin(m, name, role, structure, d->n_muscles, e)) {
        return 0;
    }
    for (int32_t i = 0; i < d->n_muscles; i++) {
        e->names[i] = d->muscles[i].name;
        e->units[i] = "1";
        e->owner[i] = i;
        e->lower[i] = low;
        e->upper[i] = high;
    }
    return 1;
}

static int is_present(const mhe_muscle_layout *l, int32_t at) {
    return l->present == NULL || l->present[at];
}

/* Bounds of entry i of a block to those of the plugin's state at place `at`. */
static void narrow(const mhe_muscle_layout *l, int32_t at, const entries *e, int32_t i) {
    e->lower[i] = fmax(e->lower[i], l->lower != NULL ? l->lower[at] : -INFINITY);
    e->upper[i] = fmin(e->upper[i], l->upper != NULL ? l->upper[at] : INFINITY);
}

/* State k of the muscles that have it, as part of z. */
static int state_block(maker *m, int32_t k) {
    mhi_system *s = m->s;
    const mhe_description *d = s->description;
    const mhe_muscle_layout *l = &s->muscle_layout;
    const mhi_bounds *b = m->setup->bounds;
    const int32_t n_m = d->n_muscles, activation = k == l->activation && b != NULL;
    int32_t n = 0;
    for (int32_t i = 0; i < n_m; i++) {
        n += is_present(l, k * n_m + i);
    }
    entries e;
    if (n == 0) {
        return 1;
    }
    if (!begin(m, l->names[k], MHE_ROLE_STATE, MHE_STRUCTURE_MUSCLE, n, &e)) {
        return 0;
    }
    n = 0;
    for (int32_t i = 0; i < n_m; i++) {
        const int32_t at = k * n_m + i;
        if (!is_present(l, at)) {
            continue;
        }
        e.names[n] = d->muscles[i].name;
        e.units[n] = l->units[k];
        e.owner[n] = i;
        e.lower[n] = activation ? b->activation_min : -INFINITY;
        e.upper[n] = activation ? b->activation_max : INFINITY;
        narrow(l, at, &e, n);
        s->z_state[s->face.n_z++] = k;
        n++;
    }
    return 1;
}

/* The activations where they are states of their own, else the control. */
static int activation_block(maker *m, int32_t role) {
    const mhi_bounds *b = m->setup->bounds;
    const mhe_muscle_layout *l = &m->s->muscle_layout;
    const int32_t structure = role == MHE_ROLE_STATE ? MHE_STRUCTURE_DIAGONAL : MHE_STRUCTURE_DENSE;
    entries e;
    if (!muscle_block(m, "activation", role, structure, b != NULL ? b->activation_min : -INFINITY,
                      b != NULL ? b->activation_max : INFINITY, &e)) {
        return 0;
    }
    for (int32_t i = 0; i < m->s->face.n_m; i++) {
        narrow(l, l->activation * m->s->face.n_m + i, &e, i);
    }
    return 1;
}

static int states(maker *m) {
    mhi_system *s = m->s;
    const mhe_muscle_layout *l = &s->muscle_layout;
    const int driven = s->formulation == MHE_FORMULATION_EXCITATION;
    const int diagonal = l->diagonal != NULL && l->diagonal[l->activation];
    s->face.n_a = !driven || diagonal ? s->face.n_m : 0;
    s->face.n_d = driven && diagonal ? s->face.n_m : 0;
    if (!positions(m) || (s->face.n_d > 0 && !activation_block(m, MHE_ROLE_STATE))) {
        return 0;
    }
    for (int32_t k = 0; k < l->n_states; k++) {
        if ((k != l->activation || (driven && !diagonal)) && !state_block(m, k)) {
            return 0;
        }
    }
    s->face.first_d = 2 * s->face.n_q;
    s->face.first_z = s->face.first_d + s->face.n_d;
    return 1;
}

/* In parts of their optimal forces. */
static int actuators(maker *m) {
    const mhi_system *s = m->s;
    entries e;
    if (s->n_actuators == 0) {
        return 1;
    }
    if (!begin(m, "actuator", MHE_ROLE_CONTROL, MHE_STRUCTURE_DENSE, s->n_actuators, &e)) {
        return 0;
    }
    for (int32_t i = 0; i < s->n_actuators; i++) {
        const mhe_actuator *a = &s->description->actuators[i];
        e.names[i] = a->name;
        e.units[i] = "1";
        e.owner[i] = i;
        e.lower[i] = isnan(a->min_control) ? -INFINITY : a->min_control;
        e.upper[i] = isnan(a->max_control) ? INFINITY : a->max_control;
    }
    return 1;
}

static int controls(maker *m) {
    static const char *const unit[] = {"N m", "N"};
    static const double scale[] = {USUAL_TORQUE, USUAL_FORCE};
    mhi_system *s = m->s;
    const mhi_bounds *b = m->setup->bounds;
    entries e;
    if (s->formulation == MHE_FORMULATION_EXCITATION) {
        if (!muscle_block(m, "excitation", MHE_ROLE_CONTROL, MHE_STRUCTURE_DENSE,
                          b != NULL ? b->excitation_min : -INFINITY,
                          b != NULL ? b->excitation_max : INFINITY, &e)) {
            return 0;
        }
    } else if (!activation_block(m, MHE_ROLE_CONTROL)) {
        return 0;
    }
    if (!m->setup->residual_torques) {
        return actuators(m);
    }
    if (!coordinate_block(m, "residual_torque", MHE_ROLE_CONTROL, unit, scale, &e)) {
        return 0;
    }
    s->n_residual = s->face.n_q;
    for (int32_t i = 0; i < s->face.n_q && b != NULL && b->torque_max != NULL; i++) {
        e.lower[i] = -b->torque_max[i];
        e.upper[i] = b->torque_max[i];
    }
    return actuators(m);
}

static int inputs(maker *m) {
    for (int32_t i = 0; i < m->s->n_forces; i++) {
        const mhi_force *f = &m->s->forces[i];
        entries e;
        if (f->layout.n_inputs == 0) {
            continue;
        }
        if (!begin(m, f->name, MHE_ROLE_INPUT, MHE_STRUCTURE_DENSE, f->layout.n_inputs, &e)) {
            return 0;
        }
        for (int32_t k = 0; k < f->layout.n_inputs; k++) {
            e.names[k] = f->layout.input_names[k];
            e.units[k] = f->layout.input_units[k];
        }
    }
    return 1;
}

/* Where muscles end, [n_m x 3]; what bodies weigh. */
static int skeleton_parameters(maker *m) {
    const mhi_system *s = m->s;
    const mhe_description *d = s->description;
    const int32_t n_i = mhi_anatomy_insertions(s->anatomy), n_b = mhi_anatomy_masses(s->anatomy);
    entries e;
    if (n_i > 0 && !begin(m, MHI_INSERTION, MHE_ROLE_PARAMETER, MHE_STRUCTURE_CONSTANT, n_i, &e)) {
        return 0;
    }
    for (int32_t i = 0; i < n_i; i++) {
        e.owner[i] = i / (n_i / s->face.n_m);
        e.names[i] = d->muscles[e.owner[i]].name;
        e.units[i] = "m";
        e.scale[i] = 0.01;
    }
    if (n_b > 0 && !begin(m, MHI_MASS, MHE_ROLE_PARAMETER, MHE_STRUCTURE_CONSTANT, n_b, &e)) {
        return 0;
    }
    for (int32_t b = 0; b < n_b; b++) {
        e.owner[b] = b;
        e.names[b] = d->bodies[b].name;
        e.units[b] = "1";
        e.lower[b] = 0;
    }
    return 1;
}

static int parameters(maker *m) {
    mhi_system *s = m->s;
    const int32_t n_m = s->face.n_m;
    for (int32_t i = 0; i < s->n_parameters; i++) {
        entries e;
        if (!begin(m, m->setup->parameters[i], MHE_ROLE_PARAMETER, MHE_STRUCTURE_CONSTANT, n_m,
                   &e)) {
            return 0;
        }
        for (int32_t k = 0; k < n_m; k++) {
            double value = 0;
            memcpy(&value, (const char *)&s->muscles[k] + s->parameter_at[i], sizeof value);
            e.names[k] = s->muscles[k].name;
            e.units[k] = mhi_parameter_unit(s, i);
            e.owner[k] = k;
            e.lower[k] = 0;
            e.scale[k] = value > 0 ? value : 1;
        }
    }
    return skeleton_parameters(m);
}

/* Whose the entries of z are, and where those of a muscle stand. */
static mhe_status index_z(mhi_system *s, mhe_error *err) {
    const int32_t n_z = s->face.n_z, n_m = s->face.n_m;
    int32_t *muscle = MHI_TAKE(&s->arena, int32_t, n_z);
    int32_t *n_of = MHI_TAKE(&s->arena, int32_t, n_m);
    if (muscle == NULL || n_of == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    int32_t first = 0;
    for (int32_t b = 0; b < s->layout.n_blocks; b++) {
        const mhe_block *block = &s->layout.blocks[b];
        for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE &&
                            block->structure == MHE_STRUCTURE_MUSCLE;
             i++) {
            const int32_t of = block->owner[i];
            muscle[first++] = of;
            n_of[of]++;
            s->face.n_k = n_of[of] > s->face.n_k ? n_of[of] : s->face.n_k;
        }
    }
    int32_t *z_of = MHI_TAKE(&s->arena, int32_t, n_m * s->face.n_k);
    if (z_of == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n_m * s->face.n_k; i++) {
        z_of[i] = -1;
    }
    memset(n_of, 0, sizeof *n_of * (size_t)n_m);
    for (int32_t i = 0; i < n_z; i++) {
        z_of[muscle[i] * s->face.n_k + n_of[muscle[i]]++] = i;
    }
    s->face.z_muscle = muscle;
    s->face.z_of = z_of;
    return MHE_OK;
}

mhe_status mhi_layout_make(mhi_system *s, const mhi_system_setup *setup, mhe_error *err) {
    const int32_t n_s = s->muscle_layout.n_states;
    maker m = {.s = s, .setup = setup};
    s->n_s = n_s;
    s->activation = s->muscle_layout.activation;
    s->z_state = MHI_TAKE(&s->arena, int32_t, n_s * s->face.n_m);
    m.blocks = MHI_TAKE(&s->arena, mhe_block, 11 + n_s + s->n_forces + s->n_parameters);
    if (s->z_state == NULL || m.blocks == NULL || !states(&m) || !controls(&m) || !inputs(&m) ||
        !parameters(&m)) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->layout = (mhe_layout){.size = sizeof s->layout,
                             .block_size = sizeof(mhe_block),
                             .n_blocks = m.n_blocks,
                             .blocks = m.blocks,
                             .n_x = m.n[MHE_ROLE_STATE],
                             .n_u = m.n[MHE_ROLE_CONTROL],
                             .n_w = m.n[MHE_ROLE_INPUT],
                             .n_p = m.n[MHE_ROLE_PARAMETER]};
    s->face.n_x = s->layout.n_x;
    s->face.n_u = s->layout.n_u;
    s->face.n_w = s->layout.n_w;
    s->face.n_p = s->layout.n_p;
    s->face.n_r = s->face.n_u - s->face.n_m;
    return index_z(s, err);
}

void mhi_layout_bounds(const mhe_layout *layout, int32_t role, double *lower, double *upper) {
    for (int32_t b = 0; b < layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(layout, b);
        if (block->role == role) {
            memcpy(lower + block->first, block->lower, sizeof *lower * (size_t)block->count);
            memcpy(upper + block->first, block->upper, sizeof *upper * (size_t)block->count);
        }
    }
}
