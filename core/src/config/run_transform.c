/* SPDX-License-Identifier: Apache-2.0 */
/* run_transform.c: the turn that data.transform asks for. */
#include "config/run_sections.h"

#include "base/pi.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static mhi_node *find_section(const mhi_run *run) {
    const mhi_node *data = mhi_node_find(mhi_tree_root(run->tree), "data");
    return data == NULL ? NULL : mhi_node_find(data, "transform");
}

/* [[a, b, c], degrees] -> [a, b, c, degrees] */
void mhi_run_flatten_rotate(const mhi_run *run) {
    const mhi_node *section = find_section(run);
    mhi_node *rotate =
        section == NULL || section->kind != MHI_MAPPING ? NULL : mhi_node_find(section, "rotate");
    if (rotate == NULL || rotate->kind != MHI_SEQUENCE || rotate->first == NULL ||
        rotate->first->kind != MHI_SEQUENCE || rotate->first->first == NULL) {
        return;
    }
    mhi_node *last = rotate->first->first;
    while (last->next != NULL) {
        last = last->next;
    }
    last->next = rotate->first->next;
    rotate->first = rotate->first->first;
}

/* 1 where the whole text is a finite number. */
static int32_t take_number(const char *text, double *value) {
    char *end = NULL;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && isfinite(*value);
}

/* Axis and degrees of the texts [n]; 0: they are none. */
static int32_t take_turn(const mhe_text_list *rotate, double axis[3], double *degrees) {
    const char *const *v = rotate->values;
    double size = 0;
    int32_t sound = rotate->n == 1 || rotate->n == 2 || rotate->n == 4;
    for (int32_t i = 0; i < 3 && sound; i++) {
        if (rotate->n == 4) {
            sound = take_number(v[i], &axis[i]);
        } else {
            axis[i] = strncasecmp(v[0], &"xyz"[i], 1) == 0;
        }
        size += axis[i] * axis[i];
    }
    sound = sound && size > 0;
    if (sound && rotate->n == 1) {
        sound = take_number(v[0] + 1, degrees);
    } else if (sound) {
        sound = take_number(v[rotate->n - 1], degrees) && (rotate->n == 4 || strlen(v[0]) == 1);
    }
    for (int32_t i = 0; i < 3 && sound; i++) {
        axis[i] /= sqrt(size);
    }
    return sound;
}

mhe_status mhi_run_check_transform(mhi_run *run, mhe_error *err) {
    mhi_transform_section *t = &run->transform;
    const mhi_node *section = find_section(run);
    double axis[3] = {1, 0, 0}, degrees = 0;
    if (t->rotate.n > 0 && !take_turn(&t->rotate, axis, &degrees)) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, mhi_node_find(section, "rotate"),
                           "data.transform: 'rotate' is an axis and degrees: x-90, [x, -90] or "
                           "[[0.6, 0.8, 0], 30]");
    }
    if (t->shift.n != 0 && t->shift.n != 3) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, mhi_node_find(section, "shift"),
                           "data.transform: 'shift' has %d values; three (m) are needed",
                           (int)t->shift.n);
    }
    if (t->scale == 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, mhi_node_find(section, "scale"),
                           "data.transform: 'scale' cannot be 0");
    }
    const double angle = degrees * MHI_PI / 180, s = sin(angle), c = cos(angle);
    const double exact_s = fabs(s) < 1e-15 ? 0 : s, exact_c = fabs(c) < 1e-15 ? 0 : c;
    for (int32_t i = 0; i < 3; i++) { /* Rodrigues */
        for (int32_t k = 0; k < 3; k++) {
            t->turn[3 * i + k] = (i == k) * exact_c + (1 - exact_c) * axis[i] * axis[k];
        }
    }
    t->turn[1] -= exact_s * axis[2];
    t->turn[2] += exact_s * axis[1];
    t->turn[3] += exact_s * axis[2];
    t->turn[5] -= exact_s * axis[0];
    t->turn[6] -= exact_s * axis[1];
    t->turn[7] += exact_s * axis[0];
    return MHE_OK;
}

void mhi_run_transform(const mhi_run *run, int32_t is_point, double xyz[3]) {
    const mhi_transform_section *t = &run->transform;
    const double in[3] = {xyz[0], xyz[1], xyz[2]};
    if (t->scale == 0) { /* of a run whose data section was not read */
        return;
    }
    for (int32_t i = 0; i < 3; i++) {
        const double *row = &t->turn[3 * i];
        xyz[i] = row[0] * in[0] + row[1] * in[1] + row[2] * in[2];
        xyz[i] *= is_point ? t->scale : t->scale < 0 ? -1 : 1;
        xyz[i] += is_point && t->shift.n == 3 ? t->shift.values[i] : 0;
    }
}
