/* SPDX-License-Identifier: Apache-2.0 */
/* description_force.c: forces other than muscles, and loops. */
#include "io/description_builder.h"

#include <string.h>

static void place_springs(mhi_builder *b, mhe_description *d) {
    mhe_path_spring *springs = mhi_build_take(b, b->path_springs.n, sizeof *springs);
    mhe_ligament *ligaments = mhi_build_take(b, b->ligaments.n, sizeof *ligaments);
    int32_t path = d->n_muscles; /* where description_path.c put them */
    for (int32_t i = 0; springs != NULL && i < b->path_springs.n; i++) {
        springs[i] = ((const mhi_path_spring_draft *)b->path_springs.items[i])->spring;
        springs[i].path = path++;
    }
    for (int32_t i = 0; ligaments != NULL && i < b->ligaments.n; i++) {
        ligaments[i] = ((const mhi_ligament_draft *)b->ligaments.items[i])->ligament;
        ligaments[i].path = path++;
    }
    d->path_springs = springs;
    d->n_path_springs = b->path_springs.n;
    d->ligaments = ligaments;
    d->n_ligaments = b->ligaments.n;
}

static void place_on_coordinates(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    mhe_coordinate_limit *limits = mhi_build_take(b, b->limits.n, sizeof *limits);
    mhe_coordinate_spring *springs = mhi_build_take(b, b->coordinate_springs.n, sizeof *springs);
    for (int32_t i = 0; limits != NULL && i < b->limits.n; i++) {
        limits[i] = *(const mhe_coordinate_limit *)b->limits.items[i];
        limits[i].coordinate = places->coordinate[limits[i].coordinate];
    }
    for (int32_t i = 0; springs != NULL && i < b->coordinate_springs.n; i++) {
        springs[i] = *(const mhe_coordinate_spring *)b->coordinate_springs.items[i];
        springs[i].coordinate = places->coordinate[springs[i].coordinate];
    }
    d->limits = limits;
    d->n_limits = b->limits.n;
    d->coordinate_springs = springs;
    d->n_coordinate_springs = b->coordinate_springs.n;
}

static void place_pair(mhi_builder *b, const mhi_places *places, const char *const names[2],
                       int32_t line, const char *what, const char *whose, int32_t body[2]) {
    for (int k = 0; k < 2; k++) {
        body[k] = mhi_build_place(b, places, names[k], line, what, whose);
    }
}

static void place_on_bodies(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    mhe_bushing *bushings = mhi_build_take(b, b->bushings.n, sizeof *bushings);
    mhe_actuator *actuators = mhi_build_take(b, b->actuators.n, sizeof *actuators);
    mhe_loop *loops = mhi_build_take(b, b->loops.n, sizeof *loops);
    for (int32_t i = 0; bushings != NULL && i < b->bushings.n; i++) {
        const mhi_bushing_draft *draft = b->bushings.items[i];
        bushings[i] = draft->bushing;
        place_pair(b, places, draft->body, draft->line, "bushing", bushings[i].name,
                   bushings[i].body);
    }
    for (int32_t i = 0; actuators != NULL && i < b->actuators.n; i++) {
        const mhi_actuator_draft *draft = b->actuators.items[i];
        mhe_actuator *out = &actuators[i];
        *out = draft->actuator;
        out->coordinate = out->coordinate < 0 ? -1 : places->coordinate[out->coordinate];
        place_pair(b, places, draft->body, draft->line, "actuator", out->name, out->body);
    }
    for (int32_t i = 0; loops != NULL && i < b->loops.n; i++) {
        const mhi_loop_draft *draft = b->loops.items[i];
        loops[i] = draft->loop;
        place_pair(b, places, draft->body, loops[i].line, "loop", loops[i].name, loops[i].body);
    }
    d->bushings = bushings;
    d->n_bushings = b->bushings.n;
    d->actuators = actuators;
    d->n_actuators = b->actuators.n;
    d->loops = loops;
    d->n_loops = b->loops.n;
}

void mhi_build_forces(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    place_springs(b, d);
    place_on_coordinates(b, d, places);
    place_on_bodies(b, d, places);
}
