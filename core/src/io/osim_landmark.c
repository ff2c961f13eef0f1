/* SPDX-License-Identifier: Apache-2.0 */
/* osim_landmark.c: frames that stand on points of a body (StationDefinedFrame). */
#include "io/osim.h"

#include <math.h>
#include <string.h>

/* The point that `socket` means to the frame: its body and its place there; 0 after an error. */
static int32_t find_point(mhi_osim *o, const mhi_osim_frame *frame, const char *name,
                          const char **body, double at[3]) {
    const char *socket = mhi_osim_socket(o, frame->landmarks, name);
    const char *path = socket == NULL ? "" : mhi_osim_absolute(o, socket, frame->path);
    for (int32_t i = 0; i < o->stations.n; i++) {
        const mhi_osim_station *station = o->stations.items[i];
        if (strcmp(station->path, path) == 0) {
            const char *parent = mhi_osim_socket(o, station->node, "parent_frame");
            double location[3] = {0};
            mhi_transform place;
            (void)mhi_xml_numbers(o, station->node, "location", location, 3);
            if (!mhi_osim_resolve(o, parent, station->path, mhi_xml_line(station->node), body,
                                  &place)) {
                return 0;
            }
            mhi_transform_point(&place, location, at);
            return 1;
        }
    }
    mhi_build_fail(&o->b, frame->line,
                   "frame '%s': its %s '%s' is no Station or Marker of the file", frame->path, name,
                   path);
    return 0;
}

/* 0, 1, 2 and the sign that "-x", "+y", "z" mean; OpenSim goes on with `otherwise` where it cannot
 * read one. */
static int32_t read_direction(mhi_osim *o, const mhi_osim_frame *frame, const char *tag,
                              int32_t otherwise, double *sign) {
    const char *text = mhi_xml_word(o, frame->landmarks, tag);
    *sign = text != NULL && *text == '-' ? -1 : 1;
    if (text != NULL) {
        const char letter = text[*text == '-' || *text == '+'];
        for (int32_t axis = 0; axis < 3; axis++) {
            if (letter == "xyz"[axis] || letter == "XYZ"[axis]) {
                return axis;
            }
        }
        mhi_build_warn(&o->b, frame->line, "frame '%s': %s '%s' is none of -x +x -y +y -z +z",
                       frame->path, tag, text);
    }
    *sign = 1;
    return otherwise;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}

/* 0: it has no direction, or next to none beside `scale`. */
static int32_t make_unit(double v[3], double scale) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) {
        v[i] /= length;
    }
    return length > 1e-12 * scale;
}

int32_t mhi_osim_landmark_frame(mhi_osim *o, const mhi_osim_frame *frame, const char **body,
                                mhi_transform *in_body) {
    static const char *const names[] = {"origin_point", "point_a", "point_b", "point_c"};
    double at[4][3], ab[3], ac[3], normal[3], third[3], sign[3];
    for (int i = 0; i < 4; i++) {
        const char *own;
        if (!find_point(o, frame, names[i], &own, at[i])) {
            return 0;
        }
        if (i > 0 && (own == NULL || *body == NULL ? own != *body : strcmp(own, *body) != 0)) {
            mhi_build_fail(
                &o->b, frame->line, "frame '%s': its points lie on several bodies ('%s' and '%s')",
                frame->path, *body != NULL ? *body : "ground", own != NULL ? own : "ground");
            return 0;
        }
        *body = own;
    }
    for (int k = 0; k < 3; k++) {
        ab[k] = at[2][k] - at[1][k];
        ac[k] = at[3][k] - at[1][k];
    }
    int32_t ok = make_unit(ab, 0) && make_unit(ac, 0);
    cross(ab, ac, normal);
    if (!ok || !make_unit(normal, 1)) {
        mhi_build_fail(&o->b, frame->line, "frame '%s': its points a, b, c lie on one line",
                       frame->path);
        return 0;
    }
    cross(ab, normal, third);
    const int32_t first = read_direction(o, frame, "ab_axis", 0, &sign[0]);
    int32_t second = read_direction(o, frame, "ab_x_ac_axis", (first + 1) % 3, &sign[1]);
    if (second == first) {
        second = (first + 1) % 3;
        sign[1] = 1;
        mhi_build_warn(&o->b, frame->line,
                       "frame '%s': ab_x_ac_axis is along ab_axis: as in OpenSim the next axis is "
                       "taken",
                       frame->path);
    }
    const int32_t last = 3 - first - second;
    sign[2] = sign[0] * sign[1] * (second == (first + 1) % 3 ? 1 : -1);
    for (int k = 0; k < 3; k++) {
        in_body->r[3 * k + first] = sign[0] * ab[k];
        in_body->r[3 * k + second] = sign[1] * normal[k];
        in_body->r[3 * k + last] = sign[2] * third[k];
    }
    memcpy(in_body->p, at[0], sizeof in_body->p);
    return 1;
}
