/* SPDX-License-Identifier: Apache-2.0 */
/* torus.c: strings through the hole of a torus, or over its rim where both ends lie on one side. */
#include "geodesic.h"

#include "../vector.h"

#include <math.h>
#include <string.h>

#define RETRIES 5
#define RETRY_TURN 0.3 /* rad */
#define AROUND 16      /* places looked at for where to begin */
#define FULL_TURN 6.283185307179586

/* Points where lines from p are tangent to the tube, by the angle about the axis. */
typedef struct contact_curve {
    double tube, ring, p[3];
    double sense; /* -1: the string goes on from there by growing angles of the tube */
} contact_curve;

static void curve_contact(const void *data, double turn, double *a, double *a_turn) {
    const contact_curve *c = data;
    double e[2] = {cos(turn), sin(turn)};
    double along = c->ring - (c->p[0] * e[0] + c->p[1] * e[1]); /* (a - p) . n = 0: */
    double up = -c->p[2], size = hypot(along, up);              /* along cos v + up sin v = -tube */
    double ratio = fmax(-1, fmin(1, -c->tube / size)), open = acos(ratio);
    double v = atan2(up, along) + c->sense * open;
    double rho = c->ring + c->tube * cos(v);
    a[0] = rho * e[0];
    a[1] = rho * e[1];
    a[2] = c->tube * sin(v);
    /* v along the curve: (up cos v - along sin v) dv + along' cos v = 0 */
    double along_turn = c->p[0] * e[1] - c->p[1] * e[0];
    double v_turn = -along_turn * cos(v) / (up * cos(v) - along * sin(v));
    double out = -c->tube * sin(v) * v_turn;
    a_turn[0] = -rho * e[1] + out * e[0];
    a_turn[1] = rho * e[0] + out * e[1];
    a_turn[2] = c->tube * cos(v) * v_turn;
}

/* Squared distance of a point of the line from the ring, or rather from the circle in the tube. */
static double ring_distance(double ring, const double *p, const double *d, double at) {
    double x = p[0] + at * d[0], y = p[1] + at * d[1], z = p[2] + at * d[2];
    double off = sqrt(x * x + y * y) - ring;
    return off * off + z * z;
}

/* Least squared distance of the line from p to s from the circle in the tube. */
static double ring_nearest(double ring, const double *p, const double *s) {
    double d[3] = {s[0] - p[0], s[1] - p[1], s[2] - p[2]}, least = INFINITY, best = 0;
    for (int k = 0; k <= AROUND; k++) {
        double at = (double)k / AROUND, square = ring_distance(ring, p, d, at);
        if (square < least) {
            least = square;
            best = at;
        }
    }
    double low = fmax(0, best - 1.0 / AROUND), high = fmin(1, best + 1.0 / AROUND);
    for (int k = 0; k < 60 && high - low > 1e-9; k++) { /* golden section */
        double a = high - 0.6180339887498949 * (high - low);
        double b = low + 0.6180339887498949 * (high - low);
        if (ring_distance(ring, p, d, a) < ring_distance(ring, p, d, b)) {
            high = b;
        } else {
            low = a;
        }
    }
    return fmin(least, ring_distance(ring, p, d, 0.5 * (low + high)));
}

/* The strings of one meridian plane, tangent from p and from s. */
typedef struct meridian {
    contact_curve from, to;
    double growing; /* 1 or -1: whether the tube's angle grows along the string */
} meridian;

/* Length of the string from p over the meridian at `turn` to s (its legs need not be in the plane);
 * *arc is its part on the tube. */
static double meridian_length(const meridian *m, double turn, double *arc) {
    double a[3], b[3], unused[3], length = 0, v[2];
    curve_contact(&m->from, turn, a, unused);
    curve_contact(&m->to, turn, b, unused);
    v[0] = atan2(a[2], hypot(a[0], a[1]) - m->from.ring);
    v[1] = atan2(b[2], hypot(b[0], b[1]) - m->from.ring);
    double angle = m->growing * (v[1] - v[0]);
    /* off a meridian that the string does not touch, the angle is less than none */
    angle -= FULL_TURN * floor(angle / FULL_TURN + 0.4);
    for (int end = 0; end < 2; end++) {
        const double *x = end ? b : a, *other = end ? m->to.p : m->from.p;
        double w[3] = {x[0] - other[0], x[1] - other[1], x[2] - other[2]};
        length += sqrt(dot3(w, w));
    }
    *arc = m->from.tube * angle;
    return length + *arc;
}

/* Where about the axis the string touches, of AROUND meridians: where it is shortest among those
 * that are in its way (arc > 0). Where these are in several stretches, the string has to pass all,
 * and the one that makes it longest holds it. Without any: where it is least off. */
static int contact_meridian(const double *length, const double *on) {
    int best = -1, deepest = 0;
    for (int k = 0; k < AROUND; k++) {
        deepest = on[k] > on[deepest] ? k : deepest;
    }
    for (int first = 0; first < AROUND; first++) {
        if (!(on[first] > 0) || (on[(first + AROUND - 1) % AROUND] > 0 && first > 0)) {
            continue; /* not where a stretch begins */
        }
        int low = first;
        for (int k = 1; k < AROUND && on[(first + k) % AROUND] > 0; k++) {
            int at = (first + k) % AROUND;
            low = length[at] < length[low] ? at : low;
        }
        for (int k = 1; k < AROUND && on[(first + AROUND - k) % AROUND] > 0; k++) {
            int at = (first + AROUND - k) % AROUND; /* (of the one that begins before 0) */
            low = length[at] < length[low] ? at : low;
        }
        best = best < 0 || length[low] > length[best] ? low : best;
    }
    return best < 0 ? deepest : best;
}

static double contact_guess(const wrap_surface *surface, const meridian *m, double *arc) {
    double length[AROUND], on[AROUND], width = FULL_TURN / AROUND;
    int axis = surface->side_axis;
    for (int k = 0; k < AROUND; k++) {
        double x[2] = {cos(k * width), sin(k * width)};
        length[k] = meridian_length(m, k * width, &on[k]);
        if (axis >= 0 && axis < 2 && x[axis] * surface->side_sign < 0) {
            on[k] = -INFINITY;
        }
    }
    int nearest = contact_meridian(length, on);
    double best = nearest * width, most = on[nearest];
    double least = most > 0 ? length[nearest] : INFINITY;
    *arc = most;
    for (int level = 0; level < 2; level++) {
        width /= 4;
        double middle = best;
        for (int k = -3; k <= 3; k++) {
            double here, value = meridian_length(m, middle + k * width, &here);
            if (here > 0 ? value < least : isinf(least) && here > most) {
                least = here > 0 ? value : least;
                most = here;
                best = middle + k * width;
                *arc = here;
            }
        }
    }
    return best;
}

int wrap_torus(const wrap_surface *surface, const double *p, const double *s,
               const wrap_string *guess, wrap_string *out) {
    double tube = surface->size[0], ring = surface->size[1], zero[3] = {0, 0, 0};
    if (ring_distance(ring, p, zero, 0) <= tube * tube ||
        ring_distance(ring, s, zero, 0) <= tube * tube) {
        return WRAP_INSIDE;
    }
    int through = (p[2] < 0) != (s[2] < 0), needs = WRAP_CROSSED;
    if (ring_nearest(ring, p, s) >= tube * tube) {
        double share = through ? p[2] / (p[2] - s[2]) : 0;
        double rho = hypot(p[0] + share * (s[0] - p[0]), p[1] + share * (s[1] - p[1]));
        if (!through || rho < ring) {
            return WRAP_NONE;
        }
        needs = WRAP_POSSIBLE;
    }
    /* the tube's angle v (0 outside, a quarter turn on top, half a turn in the hole) grows along a
     * string that comes from above through the hole, or from outside over the top */
    int outside_first = hypot(p[0], p[1]) > hypot(s[0], s[1]), above = p[2] + s[2] > 0;
    double growing = through ? (p[2] < 0 ? -1 : 1) : (outside_first == above ? 1 : -1);
    meridian m = {.from = {.tube = tube, .ring = ring, .p = {p[0], p[1], p[2]}, .sense = -growing},
                  .to = {.tube = tube, .ring = ring, .p = {s[0], s[1], s[2]}, .sense = growing},
                  .growing = growing};
    string_start start = {.contact = curve_contact, .data = &m.from};
    wrap_string string;
    double turn;
    if (guess != NULL) {
        start.turn = atan2(guess->a[1], guess->a[0]);
        start.arc = guess->arc;
        start.near = 1;
        if (string_shoot(surface, p, s, &start, &turn, out) == 0) {
            return needs;
        }
        start.near = 0;
    }
    double nearest = contact_guess(surface, &m, &start.arc), shortest = INFINITY;
    start.turn = nearest;
    if (string_shoot(surface, p, s, &start, &turn, out) == 0) {
        return needs;
    }
    for (int k = 1; k < RETRIES; k++) { /* outwards from there, alternating */
        start.turn = nearest + (k % 2 ? 1 : -1) * ((k + 1) / 2) * RETRY_TURN;
        (void)meridian_length(&m, start.turn, &start.arc);
        if (string_shoot(surface, p, s, &start, &turn, &string) == 0 &&
            wrap_length(&string) < shortest) {
            shortest = wrap_length(&string);
            *out = string;
        }
    }
    return isfinite(shortest) ? needs : WRAP_UNSOLVED;
}
