/* SPDX-License-Identifier: Apache-2.0 */
/* torus.c: strings through the hole of a torus, or over its rim where both ends lie on one side. */
#include "geodesic.h"

#include "../vector.h"

#include <math.h>
#include <string.h>

#define RETRIES 5
#define CLEAR 0.99     /* of the tube's radius: what straight parts may come near its middle */
#define RETRY_TURN 0.3 /* rad */
#define AROUND 16      /* places looked at for where to begin */
#define FULL_TURN 6.283185307179586
#define LEAST_ANGLE (0.4 * FULL_TURN)

/* Points where lines from p are tangent to the tube, by the angle about the axis. */
typedef struct contact_curve {
    double tube, ring, p[3];
    double sense; /* -1: the string goes on from there by growing angles of the tube */
} contact_curve;

/* The tangent from p to the section of the tube whose middle is `along` farther out than p:
 * cosine and sine of the tube's angle where it touches. along cos v + up sin v = -tube, since (a -
 * p) . n = 0. */
static void section_contact(const contact_curve *c, double along, double *v) {
    double up = -c->p[2], inverse = 1 / sqrt(along * along + up * up);
    double ratio = fmax(-1, fmin(1, -c->tube * inverse));
    double open = c->sense * sqrt(1 - ratio * ratio);
    v[0] = inverse * (along * ratio - up * open);
    v[1] = inverse * (up * ratio + along * open);
}

static void curve_contact(const void *data, double turn, double *a, double *a_turn) {
    const contact_curve *c = data;
    double e[2] = {cos(turn), sin(turn)}, v[2];
    double along = c->ring - (c->p[0] * e[0] + c->p[1] * e[1]);
    section_contact(c, along, v);
    double rho = c->ring + c->tube * v[0];
    a[0] = rho * e[0];
    a[1] = rho * e[1];
    a[2] = c->tube * v[1];
    /* v along the curve: (up cos v - along sin v) dv + along' cos v = 0 */
    double along_turn = c->p[0] * e[1] - c->p[1] * e[0];
    double v_turn = -along_turn * v[0] / (-c->p[2] * v[0] - along * v[1]);
    double out = -c->tube * v[1] * v_turn;
    a_turn[0] = -rho * e[1] + out * e[0];
    a_turn[1] = rho * e[0] + out * e[1];
    a_turn[2] = c->tube * v[0] * v_turn;
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

/* Length of the string from p over the meridian in direction e to s (its legs need not be in the
 * plane); *arc is its part on the tube. */
static double meridian_length(const meridian *m, const double *e, double *arc) {
    const contact_curve *curves[2] = {&m->from, &m->to};
    double length = 0, v[2][2];
    for (int end = 0; end < 2; end++) {
        const contact_curve *c = curves[end];
        section_contact(c, c->ring - (c->p[0] * e[0] + c->p[1] * e[1]), v[end]);
        double rho = c->ring + c->tube * v[end][0];
        double w[3] = {rho * e[0] - c->p[0], rho * e[1] - c->p[1], c->tube * v[end][1] - c->p[2]};
        length += sqrt(dot3(w, w));
    }
    double angle = atan2(m->growing * (v[0][0] * v[1][1] - v[0][1] * v[1][0]),
                         v[0][0] * v[1][0] + v[0][1] * v[1][1]);
    /* off a meridian that the string does not touch, the angle is less than none */
    angle += angle < -LEAST_ANGLE ? FULL_TURN : 0;
    *arc = m->from.tube * angle;
    return length + *arc;
}

static double meridian_at(const meridian *m, double turn, double *arc) {
    double e[2] = {cos(turn), sin(turn)};
    return meridian_length(m, e, arc);
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
    static const double cosine[AROUND] = {
        1,  0.9238795325112867,  0.7071067811865476,  0.3826834323650898,
        0,  -0.3826834323650898, -0.7071067811865476, -0.9238795325112867,
        -1, -0.9238795325112867, -0.7071067811865476, -0.3826834323650898,
        0,  0.3826834323650898,  0.7071067811865476,  0.9238795325112867};
    double length[AROUND], on[AROUND], width = FULL_TURN / AROUND;
    int axis = surface->side_axis;
    for (int k = 0; k < AROUND; k++) {
        double x[2] = {cosine[k], cosine[(k + 3 * AROUND / 4) % AROUND]};
        length[k] = meridian_length(m, x, &on[k]);
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
            double here, value = meridian_at(m, middle + k * width, &here);
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

/* Whether the straight parts of a string pass through the tube. */
static int string_cuts(const wrap_surface *surface, const double *p, const double *s,
                       const wrap_string *string) {
    double tube = surface->size[0] * CLEAR, ring = surface->size[1];
    return ring_nearest(ring, p, string->a) < tube * tube ||
           ring_nearest(ring, string->b, s) < tube * tube;
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
    const double *near = ring_distance(ring, p, zero, 0) < ring_distance(ring, s, zero, 0) ? p : s;
    for (int k = 0; k < RETRIES; k++) { /* beside the end that is nearer, then outwards */
        start.turn = k == 0 ? atan2(near[1], near[0])
                            : nearest + (k % 2 ? 1 : -1) * ((k + 1) / 2) * RETRY_TURN;
        (void)meridian_at(&m, start.turn, &start.arc);
        if (string_shoot(surface, p, s, &start, &turn, &string) == 0 &&
            wrap_length(&string) < shortest && !string_cuts(surface, p, s, &string)) {
            shortest = wrap_length(&string);
            *out = string;
        }
    }
    return isfinite(shortest) ? needs : WRAP_UNSOLVED;
}
