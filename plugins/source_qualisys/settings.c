/* SPDX-License-Identifier: Apache-2.0 */
/* settings.c: what QTM streams, as it describes it: markers' axes, the analog device. */
#include "qualisys.h"

#include <stdlib.h>
#include <string.h>

void qualisys_free_axes(qualisys *s, int32_t n_markers) {
    for (int32_t i = 0; i < 3 * n_markers && s->labels != NULL; i++) {
        free(s->labels[i]);
    }
    free(s->labels);
    free(s->units);
    s->labels = s->units = NULL;
}

static mhe_status name_axes(qualisys *s, mhe_error *err) {
    static char metre[] = "m";
    const int32_t n = s->parameters.n_markers;
    s->labels = calloc((size_t)(3 * n) + 1, sizeof *s->labels);
    s->units = calloc((size_t)(3 * n) + 1, sizeof *s->units);
    for (int32_t i = 0; i < 3 * n && s->labels != NULL && s->units != NULL; i++) {
        const char *name = s->parameters.markers[i / 3];
        s->units[i] = metre; /* the protocol's mm are converted */
        s->labels[i] = malloc(strlen(name) + 3);
        if (s->labels[i] == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        (void)sprintf(s->labels[i], "%s.%c", name, "xyz"[i % 3]);
    }
    return s->labels == NULL || s->units == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                 : MHE_OK;
}

static mhe_status choose_device(qualisys *s, mhe_error *err) {
    const rt_parameters *p = &s->parameters;
    s->device = -1;
    for (int32_t i = 0; i < p->n_devices && s->config.emg && s->device < 0; i++) {
        const int named = s->config.device[0] != '\0';
        s->device = !named || strcmp(p->devices[i].name, s->config.device) == 0 ? i : -1;
    }
    if (s->config.emg && s->device < 0) {
        return mhe_fail(err, MHE_RETRY, "QTM streams no analog device%s%s%s",
                        s->config.device[0] == '\0' ? "" : " '", s->config.device,
                        s->config.device[0] == '\0' ? "" : "'");
    }
    return MHE_OK;
}

static int same_device(const rt_analog_device *a, const rt_analog_device *b) {
    int same = a->id == b->id && a->rate == b->rate && a->n_channels == b->n_channels &&
               strcmp(a->name, b->name) == 0;
    for (int32_t i = 0; i < a->n_channels && same; i++) {
        same = strcmp(a->labels[i], b->labels[i]) == 0 && strcmp(a->units[i], b->units[i]) == 0;
    }
    return same;
}

static int same_parameters(const rt_parameters *a, const rt_parameters *b) {
    int same = a->frequency == b->frequency && a->up == b->up && a->n_markers == b->n_markers &&
               a->n_devices == b->n_devices;
    for (int32_t i = 0; i < a->n_markers && same; i++) {
        same = strcmp(a->markers[i], b->markers[i]) == 0;
    }
    for (int32_t i = 0; i < a->n_devices && same; i++) {
        same = same_device(&a->devices[i], &b->devices[i]);
    }
    return same;
}

mhe_status qualisys_ask_settings(qualisys *s, int *same, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    rt_parameters fresh;
    mhe_status status =
        qualisys_ask(s, s->config.emg ? "GetParameters 3D Analog" : "GetParameters 3D", RT_XML,
                     &packet, &used, err);
    if (status != MHE_OK) {
        return status;
    }
    status = rt_parse_parameters((const char *)packet.body, packet.length, &fresh, err);
    qualisys_drop(s, used);
    if (status != MHE_OK) {
        return status;
    }
    *same = same_parameters(&s->parameters, &fresh);
    qualisys_free_axes(s, s->parameters.n_markers);
    rt_free_parameters(&s->parameters);
    s->parameters = fresh;
    status = name_axes(s, err);
    if (status == MHE_OK && fresh.n_markers == 0) {
        status = mhe_fail(err, MHE_RETRY,
                          "QTM has no labelled markers: 3D data of a measurement with a list of "
                          "labels (an AIM model) are needed");
    }
    return status == MHE_OK ? choose_device(s, err) : status;
}
