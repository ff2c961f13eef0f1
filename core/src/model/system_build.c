/* SPDX-License-Identifier: Apache-2.0 */
/* system_build.c: makes and frees systems and their contexts. */
#include "model/system_private.h"
#include "plugin/instance.h"

#include <string.h>

/* Far above any body, and low enough for every size of a problem to be an int32_t. */
#define MOST_COORDINATES 500
#define MOST_MUSCLES 5000
#define MOST_MARKERS 5000

static mhe_status check_sizes(const mhe_description *d, mhe_error *err) {
    if (d->n_coordinates == 0) {
        return mhe_fail(err, MHE_E_INPUT, "%s: the model has no free coordinate", d->source);
    }
    if (d->n_coordinates > MOST_COORDINATES || d->n_muscles > MOST_MUSCLES ||
        d->n_markers > MOST_MARKERS) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: %d free coordinates, %d muscles, %d markers; at most %d, %d, %d are "
                        "possible",
                        d->source, d->n_coordinates, d->n_muscles, d->n_markers, MOST_COORDINATES,
                        MOST_MUSCLES, MOST_MARKERS);
    }
    return MHE_OK;
}

/* What a muscle plugin says of its states. */
static mhe_status check_muscle_layout(const mhi_system *s, const char *id, mhe_error *err) {
    const mhe_muscle_layout *l = &s->muscle_layout;
    const int32_t n_m = s->description->n_muscles;
    if (l->n_states < 1 || l->n_states > MHE_MUSCLE_MAX_STATES) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives %d states a muscle; 1 to %d can be",
                        id, l->n_states, MHE_MUSCLE_MAX_STATES);
    }
    if (l->activation < 0 || l->activation >= l->n_states) {
        return mhe_fail(err, MHE_E_PLUGIN,
                        "%s: layout() names state %d as the activation, of %d states", id,
                        l->activation, l->n_states);
    }
    if (l->names == NULL || l->units == NULL || l->n_parameters < 0 ||
        (l->n_parameters > 0 && l->parameter_names == NULL)) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives no names or units", id);
    }
    for (int32_t k = 0; k < l->n_states; k++) {
        if (l->names[k] == NULL || l->units[k] == NULL || l->names[k][0] == '\0') {
            return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives state %d no name or unit", id,
                            k);
        }
        for (int32_t j = 0; j < k; j++) {
            if (strcmp(l->names[j], l->names[k]) == 0) {
                return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives two states the name '%s'",
                                id, l->names[k]);
            }
        }
    }
    if (strcmp(l->names[l->activation], "activation") != 0) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() calls the activation '%s'", id,
                        l->names[l->activation]);
    }
    for (int32_t i = 0; i < n_m && l->present != NULL; i++) {
        if (!l->present[l->activation * n_m + i]) {
            return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives muscle '%s' no activation", id,
                            s->description->muscles[i].name);
        }
    }
    if (l->diagonal != NULL && l->diagonal[l->activation] && s->muscle->diagonal_rate == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: a diagonal state, but no diagonal_rate()", id);
    }
    return l->n_states > 1 && s->muscle->equilibrium == NULL
               ? mhe_fail(err, MHE_E_PLUGIN, "%s: %d states a muscle, but no equilibrium()", id,
                          l->n_states)
               : MHE_OK;
}

/* Makes a stretch of coordinates one of whole fours where the model has so many: its loops take
 * four side by side (paths.c). */
static void widen(int32_t n_q, int32_t *first, int32_t *end) {
    const int32_t wide = (*end - *first + 3) / 4 * 4;
    if (wide > 0 && wide <= n_q) {
        *first = *first < n_q - wide ? *first : n_q - wide;
        *end = *first + wide;
    }
}

/* The range of coordinates that each path sees, outside of which its derivatives are 0. */
static mhe_status find_ranges(mhi_system *s, mhe_error *err) {
    const int32_t n_q = s->description->n_coordinates, n_p = s->n_paths;
    uint8_t *pattern = MHI_TAKE(&s->arena, uint8_t, n_p * n_q);
    s->first = MHI_TAKE(&s->arena, int32_t, n_p);
    s->end = MHI_TAKE(&s->arena, int32_t, n_p);
    if (pattern == NULL || s->first == NULL || s->end == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    if (s->model->path_pattern != NULL) {
        status = s->model->path_pattern(s->model_self, pattern, err);
    } else {
        memset(pattern, 1, (size_t)(n_p * n_q));
    }
    for (int32_t m = 0; m < n_p; m++) {
        s->first[m] = n_q;
        for (int32_t j = 0; j < n_q; j++) {
            if (pattern[m * n_q + j]) {
                s->first[m] = j < s->first[m] ? j : s->first[m];
                s->end[m] = j + 1;
            }
        }
        widen(n_q, &s->first[m], &s->end[m]);
    }
    return status;
}

/* What a plugin says of the model's numbers it says without the file's name. */
static mhe_status at_source(mhe_status status, const mhe_description *d, mhe_error *err) {
    if (status == MHE_E_INPUT && err != NULL && d->source != NULL) {
        const mhe_error why = *err;
        return mhe_fail(err, status, "%s: %.600s", d->source, why.text);
    }
    return status;
}

static mhe_status create_parts(mhi_system *s, const mhi_system_setup *setup, mhe_error *err) {
    const mhe_description *d = setup->description;
    mhe_status status = at_source(
        mhi_model_create(setup->model, setup->host, d, setup->model_config, &s->model_self, err), d,
        err);
    if (status == MHE_OK) {
        status = find_ranges(s, err);
    }
    s->muscle_plugin = setup->muscle;
    s->muscle_config = setup->muscle_config;
    s->muscles = MHI_TAKE(&s->arena, mhe_muscle, d->n_muscles);
    if (status == MHE_OK && s->muscles == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        memcpy(s->muscles, d->muscles, sizeof *s->muscles * (size_t)d->n_muscles);
        status = at_source(mhi_muscle_create(setup->muscle, setup->host, s->muscles, d->n_muscles,
                                             setup->muscle_config, &s->muscle_self,
                                             &s->muscle_layout, err),
                           d, err);
    }
    if (status == MHE_OK) {
        status = check_muscle_layout(s, setup->muscle->id, err);
        if (status != MHE_OK && err != NULL) {
            err->part = MHE_PART_MUSCLE;
        }
    }
    if (status == MHE_OK) {
        status = mhi_parameters_find(s, setup, err);
    }
    if (status == MHE_OK) {
        status = mhi_anatomy_create(setup, &s->arena, &s->anatomy, err);
    }
    if (status == MHE_OK) {
        status = mhi_forces_create(s, setup, err);
    }
    if (status == MHE_OK) {
        status = mhi_loops_prepare(s, err);
    }
    if (status == MHE_OK && setup->actuators) {
        s->n_actuators = d->n_actuators;
        status = mhi_actuators_check(s, err);
    }
    return status == MHE_OK ? mhi_layout_make(s, setup, err) : status;
}

mhe_status mhi_system_create(const mhi_system_setup *setup, mhi_system **system, mhe_error *err) {
    *system = NULL;
    const mhe_description *d = setup->description;
    mhe_status status = check_sizes(d, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_arena arena = {0};
    mhi_system *s = MHI_TAKE(&arena, mhi_system, 1);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->arena = arena;
    s->description = d;
    s->formulation = setup->formulation;
    s->model = setup->model->ops;
    s->model_plugin = setup->model;
    s->model_config = setup->model_config;
    s->muscle = setup->muscle->ops;
    s->n_paths = d->n_paths;
    s->face = (mhe_system){.size = sizeof s->face,
                           .layout = &s->layout,
                           .n_q = d->n_coordinates,
                           .n_m = d->n_muscles,
                           .data = s,
                           .acceleration = mhi_system_acceleration,
                           .activation_rate = mhi_system_activation_rate};
    status = create_parts(s, setup, err);
    if (status == MHE_OK) {
        status = mhi_forces_check(s, err);
    }
    if (status == MHE_OK && s->n_c > 0) {
        status = mhi_loops_tell(s, setup->host, err);
    }
    if (status != MHE_OK) {
        mhi_system_free(s);
        return status;
    }
    *system = s;
    return MHE_OK;
}

void mhi_system_free(mhi_system *s) {
    if (s == NULL) {
        return;
    }
    mhi_forces_destroy(s);
    if (s->muscle_self != NULL) {
        s->muscle->destroy(s->muscle_self);
    }
    mhi_anatomy_free(s->anatomy);
    if (s->model_self != NULL) {
        s->model->destroy(s->model_self);
    }
    mhi_arena arena = s->arena; /* the system lies in its own arena */
    mhi_arena_free(&arena);
}

const mhe_description *mhi_system_description(const mhi_system *s) {
    return s->description;
}

int32_t mhi_system_formulation(const mhi_system *s) {
    return s->formulation;
}

const mhe_system *mhi_system_face(const mhi_system *s) {
    return &s->face;
}

/* Of a matrix of derivatives of accelerations, one for the closing of a posture. */
static int32_t most_columns(const mhi_system *s) {
    const int32_t of[] = {1, s->face.n_q, s->face.n_m, s->face.n_z, s->face.n_p, s->face.n_r};
    int32_t most = 0;
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        most = of[i] > most ? of[i] : most;
    }
    return most;
}

static mhe_status take_arrays(mhi_system_context *c, mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_m = s->face.n_m, n_p = s->n_paths, n_z = s->face.n_z;
    const int32_t n_p_all = s->n_parameters > 0 ? s->muscle_layout.n_parameters : 0;
    const int32_t n_s = n_m * s->n_s, other = s->n_forces > 0 ? n_q : 0, n_t = s->most_paths;
    const int32_t n_c = s->n_c, wide = most_columns(s);
    const int32_t n_f = s->most_pairs, per_pair = n_f > 0 ? n_q : 0;
    const mhi_room rooms[] = {{&c->zero, n_q},
                              {&c->mass, n_q * n_q},
                              {&c->bias, n_q},
                              {&c->length, n_p},
                              {&c->length_q, n_p * n_q},
                              {&c->length_qq, n_p * n_q * n_q},
                              {&c->velocity, n_p},
                              {&c->velocity_q, n_p * n_q},
                              {&c->state, n_s},
                              {&c->force, n_m},
                              {&c->force_l, n_m},
                              {&c->force_w, n_m},
                              {&c->force_s, n_s},
                              {&c->force_z, n_z},
                              {&c->rate, n_s},
                              {&c->rate_e, n_s},
                              {&c->rate_l, n_s},
                              {&c->rate_w, n_s},
                              {&c->rate_s, n_s * s->n_s},
                              {&c->force_q, n_m * n_q},
                              {&c->force_v, n_m * n_q},
                              {&c->moment, n_q},
                              {&c->moment_q, n_q * n_q},
                              {&c->moment_v, n_q * n_q},
                              {&c->solved, MHI_SOLVED_LD(n_q) * n_q},
                              {&c->tau_q, n_q * n_q},
                              {&c->tau_v, n_q * n_q},
                              {&c->other, other},
                              {&c->other_q, other * n_q},
                              {&c->other_v, other * n_q},
                              {&c->own, other},
                              {&c->own_q, other * n_q},
                              {&c->own_v, other * n_q},
                              {&c->tension, n_t},
                              {&c->tension_l, n_t},
                              {&c->tension_w, n_t},
                              {&c->t_length, n_t},
                              {&c->t_velocity, n_t},
                              {&c->load, 9 * s->most_loads},
                              {&c->body, n_f > 0 ? 12 * s->description->n_bodies : 0},
                              {&c->deflection, 6 * n_f},
                              {&c->deflection_rate, 6 * n_f},
                              {&c->push, 6 * n_f},
                              {&c->push_d, 36 * n_f},
                              {&c->push_w, 36 * n_f},
                              {&c->pair_rows, 6 * n_f * n_q},
                              {&c->pair_loads, 36 * per_pair},
                              {&c->pair_q, per_pair * n_q},
                              {&c->pair_work, 18 * per_pair},
                              {&c->pair_turn, 3 * per_pair},
                              {&c->row_q, n_q},
                              {&c->row_v, n_q},
                              {&c->all_force_p, n_p_all * n_m},
                              {&c->all_rate_p, n_p_all * n_s},
                              {&c->force_p, s->face.n_p},
                              {&c->moment_p, n_q * s->face.n_p},
                              {&c->drive, s->n_actuators > 0 ? n_q : 0},
                              {&c->drive_q, s->n_actuators > 0 ? n_q * n_q : 0},
                              {&c->drive_r, s->n_actuators * n_q},
                              {&c->gap, n_c},
                              {&c->gap_q, n_c * n_q},
                              {&c->gap_rate, n_c},
                              {&c->gap_rate_q, n_c * n_q},
                              {&c->gap_rate_v, n_c * n_q},
                              {&c->gap_acceleration, n_c},
                              {&c->gap_acceleration_q, n_c * n_q},
                              {&c->gap_acceleration_v, n_c * n_q},
                              {&c->loop_force, n_c},
                              {&c->loop_push, n_c * n_q},
                              {&c->loop_factor, n_c * n_c},
                              {&c->loop_value, 9 * s->n_loop_loads},
                              {&c->loop_columns, n_c * wide}};
    if (MHI_TAKE_ROOMS(&c->arena, rooms, err) != MHE_OK) {
        return MHE_E_MEMORY;
    }
    c->loop_order = MHI_TAKE(&c->arena, int32_t, n_c);
    return c->loop_order == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

mhe_status mhi_system_context_create(const mhi_system *s, mhi_system_context **context,
                                     mhe_error *err) {
    *context = NULL;
    mhi_arena arena = {0};
    mhi_system_context *c = MHI_TAKE(&arena, mhi_system_context, 1);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->system = s;
    c->arena = arena;
    mhe_status status = take_arrays(c, err);
    if (status == MHE_OK) {
        status = s->model->context_create(s->model_self, &c->model, err);
    }
    if (status == MHE_OK && s->anatomy != NULL) {
        status = mhi_anatomy_enter(s->anatomy, &c->arena, &c->model, &c->anatomy, err);
    }
    if (status != MHE_OK) {
        mhi_system_context_free(c);
        return status;
    }
    *context = c;
    return MHE_OK;
}

void mhi_system_context_free(mhi_system_context *c) {
    if (c == NULL) {
        return;
    }
    mhi_anatomy_leave(c->anatomy);
    if (c->model != NULL) {
        c->system->model->context_destroy(c->model);
    }
    mhi_arena arena = c->arena;
    mhi_arena_free(&arena);
}
