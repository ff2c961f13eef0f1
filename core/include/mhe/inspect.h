/* SPDX-License-Identifier: Apache-2.0 */
/* inspect.h: what is in a model file, and what the model says at given poses. */
#ifndef MHE_INSPECT_H
#define MHE_INSPECT_H

#include <mhe/host.h>
#include <mhe/library.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What is in the model file `file` (.osim, .bioMod): coordinates with their ranges, couplers and
 * what is locked, bodies and masses, muscles with the coordinates that they cross, obstacles, other
 * forces, markers; what is unsupported, left out or repaired, with file:line. `format`:
 * MHE_FORMAT_TEXT or MHE_FORMAT_JSON. `host` may be NULL. `*text` is the caller's: mhe_free().
 * MHE_E_INPUT: the file cannot be read. [cold] */
MHE_API mhe_status mhe_model_info(const mhe_host *host, const char *file, int32_t format,
                                  char **text, mhe_error *err);

#define MHE_PATHS_EXACT 0
#define MHE_PATHS_FITTED 1 /* polynomials that the model plugin fits to them */

/* The model `file` at the poses of a JSON text `poses` [length], called `name` in messages:
 *
 *     {"poses": [{"q": {COORDINATE: rad or m}, "u": {...}, "udot": {...},
 *                 "activation": 0.5 or {MUSCLE: 0.5},
 *                 "forces": {MUSCLE or ACTUATOR: N or N m},
 *                 "external": [{"body", "force", "point", "torque"}]}]}      all in ground
 *
 * What is left out has the model's default, or 0. Dependents and held coordinates are computed, not
 * read; u and udot are derivatives of the coordinates. Locked coordinates have their value, but
 * their u and udot are read, and enter inverse dynamics. The answer, JSON:
 *
 *     {"coordinates": [independent, free names],
 *      "poses": [{"q", "udot": {every coordinate}, "bodies": {BODY: [x, y, z, rotation row by
 * row]}, "markers": {MARKER: [x, y, z]}, "lines": {PATH: {"length", "speed", "moment_arm":
 * {COORDINATE: -dL/dq}}}, "mass_matrix": [[...]], "inverse_dynamics": {COORDINATE: N m or N},
 *                 "muscles": {MUSCLE: {"fiber_length", "fiber_velocity", "pennation", "active",
 *                                      "passive", "tendon_force"}},    rigid tendons; by activation
 *                 "reactions": {JOINT: {"force", "moment"}}}]}           where forces are given
 *
 * Muscles have rigid tendons; one that is slack is reported as OpenSim does: its fibre stands at
 * the shortest, and a tendon never pushes (in a run the curves go on smoothly there).
 *
 * Inverse dynamics: M udot + bias - external loads, no muscles, by the free coordinates with what
 * follows them. Reactions act on the child at the joint's frame in it, in ground; every load that
 * is given acts. `*text` is the caller's: mhe_free(). MHE_E_INPUT: a file cannot be read, or names
 * what the model has not. [cold] */
MHE_API mhe_status mhe_model_evaluate(const mhe_host *host, const char *file, const char *name,
                                      const char *poses, size_t length, int32_t paths, char **text,
                                      mhe_error *err);

/* Where lengths of the model's paths jump by more than 1 mm while one free coordinate after the
 * other goes through its range (within half a turn, or 1 m, about 0) in `steps` steps, the others
 * at their defaults: path, coordinate, its value, size, and whether a conditional point of the path
 * goes on or off there. A solver's steps do not see a jump coming. `format`, `host`, `*text` as of
 * mhe_model_info(). JSON: {"paths": how many, "steps", "least": m, "jumps": [{"path", "coordinate",
 * "at": rad or m, "size": m, "conditional"}]}. MHE_E_ARGUMENT: steps not within 1 .. 100000. [cold]
 */
MHE_API mhe_status mhe_model_sweep(const mhe_host *host, const char *file, int32_t steps,
                                   int32_t format, char **text, mhe_error *err);

/* Scales a generic model to a person as a Scale setup of OpenSim's says (<ScaleTool>; files beside
 * it): bodies by distances of markers in a static trial and by factors stated; with them joints,
 * paths, obstacles, masses, and each muscle's optimal fibre and tendon slack length by that of its
 * path in the default pose. Then the markers are moved to where the static pose has them. Writes
 * the model to the file `out`; `*text` says what was done, for people, and is the caller's:
 * mhe_free(). Inertias are stretched with the body, at any factors; OpenSim takes a cylinder where
 * factors differ. MHE_E_INPUT: "file:line: what is wrong". `host` may be NULL. [cold] */
MHE_API mhe_status mhe_model_scale(const mhe_host *host, const char *setup, const char *out,
                                   char **text, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
