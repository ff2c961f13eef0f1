/* SPDX-License-Identifier: Apache-2.0 */
/* inside.c: tells of paths that end inside what they are to wrap around. */
#include "context.h"

#include <mhe/host.h>

#include <stdio.h>
#include <stdlib.h>

static void tell_route(const mhe_host *host, const mhe_description *d, const path_route *route,
                       const route_work *work) {
    for (int32_t w = 0; w < route->n_wraps; w++) {
        if (work->state[w] == WRAP_INSIDE) {
            const mhe_path *path = &d->paths[route->path];
            char text[512];
            (void)snprintf(text, sizeof text,
                           "%s:%d: path '%s' has a point inside '%s' at the default position: as "
                           "in OpenSim it passes straight",
                           d->source != NULL ? d->source : "", (int)path->line, path->name,
                           d->obstacles[path->wraps[w].obstacle].name);
            host->log(host, MHE_LOG_WARNING, text);
        }
    }
}

mhe_status simbody_tell_inside(simbody_model *model, mhe_error *err) {
    const mhe_description *d = model->description;
    const route_set *routes[2] = {model->routes, model->whole};
    void *context = NULL;
    double *q = calloc(2 * (size_t)d->n_coordinates + 1, sizeof *q);
    mhe_status status = q == NULL ? mhe_fail(err, MHE_E_MEMORY, "no memory for the model")
                                  : simbody_context_create(model, &context, err);
    for (int32_t i = 0; i < d->n_coordinates && q != NULL; i++) {
        q[i] = d->coordinates[i].value;
    }
    mhe_kinematics nothing = {.size = sizeof nothing};
    /* a model that cannot be placed there says so when it is used */
    if (status == MHE_OK &&
        simbody_kinematics(context, q, q + d->n_coordinates, &nothing, NULL) == MHE_OK) {
        simbody_context *c = context;
        path_pose pose = {.r = c->r, .p = c->p, .slopes = c->slopes};
        for (int set = 0; set < 2; set++) {
            for (int32_t i = 0; routes[set] != NULL && i < routes[set]->n; i++) {
                if (routes[set]->routes[i].n_wraps > 0) {
                    course_find(&routes[set]->routes[i], &pose, c->numbers, &c->route_work);
                    tell_route(model->host, d, &routes[set]->routes[i], &c->route_work);
                }
            }
        }
    }
    simbody_context_destroy(context);
    free(q);
    return status;
}
