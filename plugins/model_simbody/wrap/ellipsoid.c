/* SPDX-License-Identifier: Apache-2.0 */
/* ellipsoid.c: strings over an ellipsoid. The lengths of a fan of strings in planes (fan.h) show
 * where the shortest one lies, and where the geodesic is to be looked for. */
#include "fan.h"
#include "geodesic.h"

#include "../vector.h"

#include <math.h>
#include <string.h>

#define TRIED 3   /* strings solved exactly at most */
#define NEAR 0.03 /* of the length: planes that are not worse than that may hold the shortest */
#define ON 1e-5   /* of the squares that are 1 on the surface: an end that is meant to be there */
#define PASSES 4
#define SURE 0.6       /* twice what it begins to let go at (fade.h), by the fan's measure */
#define PASS_TURN 0.15 /* rad */
#define SAME 1e-9      /* of a length: the same string */

/* Points where lines from p are tangent: a circle of the scaled frame. */
typedef struct contact_circle {
    double size[3], centre[3], axes[2][3];
} contact_circle;

static void circle_contact(const void *data, double turn, double *a, double *a_turn) {
    const contact_circle *c = data;
    double x = cos(turn), y = sin(turn);
    for (int i = 0; i < 3; i++) {
        a[i] = c->size[i] * (c->centre[i] + x * c->axes[0][i] + y * c->axes[1][i]);
        a_turn[i] = c->size[i] * (x * c->axes[1][i] - y * c->axes[0][i]);
    }
}

static void contact_circle_of(const fan *f, contact_circle *c) {
    double square = dot3(f->p, f->p), radius = sqrt(1 - 1 / square), u[3];
    for (int i = 0; i < 3; i++) {
        u[i] = f->p[i] / sqrt(square);
        c->centre[i] = f->p[i] / square;
    }
    frame_across(u, c->axes[0], c->axes[1]);
    for (int i = 0; i < 3; i++) {
        c->axes[0][i] *= radius;
        c->axes[1][i] *= radius;
    }
    memcpy(c->size, f->size, sizeof c->size);
}

/* An end that is on the surface but for rounding is put above it, by so little (some nm) that
 * nothing but the search for the string knows: there, a straight part of no length has no
 * direction. */
static void end_lift(const wrap_surface *surface, const double *at, double *out) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
        square += at[i] / surface->size[i] * (at[i] / surface->size[i]);
    }
    double scale = fabs(square - 1) < ON ? sqrt((1 + ON) / square) : 1;
    for (int i = 0; i < 3; i++) {
        out[i] = scale * at[i];
    }
}

static int solve_from(const wrap_surface *surface, const double *p, const double *s, const fan *f,
                      double angle, int passes, wrap_string *out) {
    contact_circle circle;
    fan_string guess;
    double from[3], turn;
    contact_circle_of(f, &circle);
    const double half_plane[2] = {cos(angle), sin(angle)};
    fan_string_at(f, half_plane, -1, &guess);
    for (int i = 0; i < 3; i++) {
        from[i] = guess.a[i] - circle.centre[i];
    }
    string_start start = {.contact = circle_contact,
                          .data = &circle,
                          .turn = atan2(dot3(from, circle.axes[1]), dot3(from, circle.axes[0])),
                          .arc = guess.arc,
                          .passes = passes};
    return string_shoot(surface, p, s, &start, &turn, out);
}

/* The shortest string that is found from the fan's shortest ones, of those allowed. */
static int shortest_of(const wrap_surface *surface, const double *p, const double *s, const fan *f,
                       const fan_string *strings, const int *allowed, wrap_string *out) {
    double shortest = INFINITY, least = INFINITY;
    int tried[FAN] = {0};
    for (int round = 0; round < TRIED; round++) {
        int best = -1;
        for (int k = 0; k < FAN; k++) {
            int before = (k + FAN - 1) % FAN, after = (k + 1) % FAN;
            double length = strings[k].length;
            int lowest = isinf(shortest) || /* all are tried until one is found */
                         (!(strings[before].length < length) && !(strings[after].length < length));
            if (allowed[k] && !tried[k] && lowest && (best < 0 || length < strings[best].length)) {
                best = k;
            }
        }
        if (best < 0 || (isfinite(shortest) && strings[best].length > least * (1 + NEAR))) {
            break;
        }
        wrap_string string;
        tried[best] = 1;
        least = fmin(least, strings[best].length);
        if (solve_from(surface, p, s, f, fan_angle(strings, best), 0, &string) == 0 &&
            wrap_length(&string) < shortest) {
            shortest = wrap_length(&string);
            *out = string;
        }
    }
    return isfinite(shortest);
}

/* From a string between ends nearby: 0: found. */
static int solve_near(const wrap_surface *surface, const double *p, const double *s, const fan *f,
                      const wrap_string *guess, wrap_string *out) {
    contact_circle circle;
    double from[3], turn;
    contact_circle_of(f, &circle);
    for (int i = 0; i < 3; i++) {
        from[i] = guess->a[i] / f->size[i] - circle.centre[i];
    }
    string_start start = {.contact = circle_contact,
                          .data = &circle,
                          .turn = atan2(dot3(from, circle.axes[1]), dot3(from, circle.axes[0])),
                          .arc = guess->arc,
                          .near = 1};
    return string_shoot(surface, p, s, &start, &turn, out);
}

static int string_of(const wrap_surface *surface, const double *p, const double *s,
                     const wrap_string *guess, wrap_string *out) {
    fan f;
    fan_string strings[FAN];
    int needs = fan_of(surface, p, s, &f), axis = surface->side_axis;
    int allowed[FAN], any = 0;
    if (needs != WRAP_CROSSED) {
        return needs;
    }
    if (guess != NULL && solve_near(surface, p, s, &f, guess, out) == 0) {
        out->held = guess->held;
        return needs;
    }
    fan_spread(&f, axis, strings);
    for (int k = 0; k < FAN; k++) {
        allowed[k] = axis < 0 || strings[k].apex * surface->side_sign >= 0;
        any |= allowed[k];
    }
    if (any && shortest_of(surface, p, s, &f, strings, allowed, out)) {
        out->held = !allowed[fan_lowest(strings)];
        return needs;
    }
    for (int k = 0; k < FAN; k++) { /* no string holds on that side */
        allowed[k] = 1;
    }
    return shortest_of(surface, p, s, &f, strings, allowed, out) ? needs : WRAP_UNSOLVED;
}

static void exchange3(double *a, double *b, double sign) {
    for (int i = 0; i < 3; i++) {
        double x = sign * a[i];
        a[i] = sign * b[i];
        b[i] = x;
    }
}

static void exchange(double *a, double *b) {
    double x = *a;
    *a = *b;
    *b = x;
}

/* The same string from s to p. Its fields are those of the inverse, seen backwards. */
static void string_reverse(wrap_string *string) {
    exchange3(string->a, string->b, 1);
    exchange3(string->t[0], string->t[1], -1);
    exchange3(string->n[0], string->n[1], 1);
    exchange(&string->straight[0], &string->straight[1]);
    exchange(&string->field[0], &string->field[3]);
}

int wrap_ellipsoid(const wrap_surface *surface, const double *p_given, const double *s_given,
                   const wrap_string *guess, wrap_string *out) {
    double p[3], s[3];
    end_lift(surface, p_given, p);
    end_lift(surface, s_given, s);
    int state = string_of(surface, p, s, guess, out);
    if (state == WRAP_UNSOLVED) { /* it is aimed from p: from s it may be easier */
        state = string_of(surface, s, p, NULL, out);
        if (state > 0) {
            string_reverse(out);
        }
    }
    return state;
}

/* The highest string of the fan on the way from the k-th to the lowest one, in steps of `way`. */
static int fan_top(const fan_string *strings, int k, int lowest, int way) {
    int top = k;
    for (int i = k; i != lowest; i = (i + FAN + way) % FAN) {
        top = strings[i].length > strings[top].length ? i : top;
    }
    return top;
}

/* The pass near the fan's highest string, from there on in steps of `way`. 0: found. */
static int pass_of(const wrap_surface *surface, const double *p, const double *s, const fan *f,
                   const fan_string *strings, int top, int way, double above, wrap_string *out) {
    double angle = fan_angle(strings, top);
    for (int try = 0; try < PASSES; try++) {
        if (solve_from(surface, p, s, f, angle + way * try * PASS_TURN, 1, out) == 0 &&
            wrap_length(out) > above) {
            return 0;
        }
    }
    return -1;
}

int wrap_slips(const wrap_surface *surface, const double *p_given, const double *s_given,
               const wrap_string *held, wrap_string *shortest, wrap_string *pass) {
    double p[3], s[3];
    end_lift(surface, p_given, p);
    end_lift(surface, s_given, s);
    fan f;
    fan_string strings[FAN];
    int all[FAN], k = 0, found = 0;
    double near = INFINITY, least = INFINITY, length = wrap_length(held);
    if (!held->held || fan_of(surface, p, s, &f) != WRAP_CROSSED) {
        return 0;
    }
    fan_spread(&f, -1, strings);
    for (int i = 0; i < FAN; i++) {
        double square = 0;
        for (int j = 0; j < 3; j++) {
            double d = strings[i].a[j] - held->a[j] / f.size[j];
            square += d * d;
        }
        k = square < near ? i : k;
        near = fmin(near, square);
        all[i] = 1;
    }
    int lowest = fan_lowest(strings),
        tops[2] = {fan_top(strings, k, lowest, -1), fan_top(strings, k, lowest, 1)};
    double lower = fmin(strings[tops[0]].length, strings[tops[1]].length);
    if (lower - strings[k].length > SURE * (strings[k].length - strings[lowest].length) ||
        !shortest_of(surface, p, s, &f, strings, all, shortest) ||
        !(wrap_length(shortest) < length * (1 - SAME))) {
        return 0; /* (held by far; by nothing) */
    }
    for (int e = 0; e < 2; e++) {
        wrap_string string;
        if (strings[tops[e]].length < lower * (1 + NEAR) &&
            pass_of(surface, p, s, &f, strings, tops[e], 2 * e - 1, length, &string) == 0 &&
            wrap_length(&string) < least) {
            least = wrap_length(&string);
            *pass = string;
            found = 1;
        }
    }
    return found;
}
