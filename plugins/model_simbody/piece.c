/* SPDX-License-Identifier: Apache-2.0 */
/* piece.c: a piece of a course, a straight line or a string, by its ends. */
#include "route.h"
#include "vector.h"
#include "wrap/fade.h"

#include <math.h>
#include <string.h>

/* out = r^T (at - p) */
static void into_frame(const double *frame, const double *at, double *out) {
    double d[3] = {at[0] - frame[9], at[1] - frame[10], at[2] - frame[11]};
    for (int i = 0; i < 3; i++) {
        out[i] = frame[i] * d[0] + frame[3 + i] * d[1] + frame[6 + i] * d[2];
    }
}

int string_between(const path_route *route, int32_t w, const double *p, const double *s,
                   const wrap_string *before, const route_work *work, wrap_string *out) {
    const double *frame = work->obstacles + 12 * w;
    double ends[2][3];
    wrap_string guess;
    into_frame(frame, p, ends[0]);
    into_frame(frame, s, ends[1]);
    if (before != NULL) {
        into_frame(frame, before->a, guess.a);
        guess.arc = before->arc;
        guess.held = before->held;
        guess.way = before->way;
        guess.keeps = before->keeps;
    }
    out->keeps = 0;
    int state =
        wrap_solve(&route->wraps[w].surface, ends[0], ends[1], before != NULL ? &guess : NULL, out);
    if (state > 0) {
        place3(frame, frame + 9, out->a, out->a);
        place3(frame, frame + 9, out->b, out->b);
        for (int k = 0; k < 2; k++) {
            rotate3(frame, out->t[k], out->t[k]);
            rotate3(frame, out->n[k], out->n[k]);
        }
    }
    return state;
}

/* m = r m r^T */
static void turn_back(const double *r, double *m) {
    double half[9], transposed[9];
    multiply3(r, m, half);
    for (int i = 0; i < 9; i++) {
        transposed[i] = r[i % 3 * 3 + i / 3];
    }
    multiply3(half, transposed, m);
}

double string_off(const path_route *route, int32_t w, const route_work *work, const double *at) {
    double x[3];
    into_frame(work->obstacles + 12 * w, at, x);
    return wrap_outside(&route->wraps[w].surface, x);
}

double string_off_derivatives(const path_route *route, int32_t w, const route_work *work,
                              const double *at, double *g, double *h) {
    const double *frame = work->obstacles + 12 * w;
    double x[3];
    into_frame(frame, at, x);
    double off = wrap_outside_derivatives(&route->wraps[w].surface, x, g, h);
    rotate3(frame, g, g);
    turn_back(frame, h);
    return off;
}

int string_clears(const path_route *route, int32_t w, const route_work *work, double *at) {
    const double *frame = work->obstacles + 12 * w;
    double x[3];
    into_frame(frame, at, x);
    if (!wrap_clears(&route->wraps[w].surface, x)) {
        return 0;
    }
    place3(frame, frame + 9, x, at);
    return 1;
}

void piece_ends(const route_work *work, const course_piece *piece, const double *ends[2]) {
    for (int e = 0; e < 2; e++) {
        ends[e] = piece->joint[e] >= 0 ? work->joints[piece->joint[e]].at
                                       : work->places + 3 * piece->point[e];
    }
}

static double straight_length(const double *p, const double *s, double *g, double *pp, double *ps,
                              double *ss) {
    double u[3] = {s[0] - p[0], s[1] - p[1], s[2] - p[2]}, l = sqrt(dot3(u, u));
    double inverse = l < 1e-9 ? 0 : 1 / l;
    if (g == NULL) {
        return l;
    }
    for (int i = 0; i < 3; i++) {
        u[i] *= inverse;
        g[i] = -u[i];
        g[3 + i] = u[i];
    }
    memset(pp, 0, 9 * sizeof *pp);
    for (int i = 0; i < 3; i++) {
        pp[4 * i] = inverse;
    }
    add_outer3(pp, -inverse, u, u);
    for (int i = 0; i < 9; i++) {
        ss[i] = pp[i];
        ps[i] = -pp[i];
    }
    return l;
}

/* Whether an end may come nearer to the obstacle's body. */
static int end_moves(const path_route *route, const course_piece *piece, int e) {
    return piece->joint[e] < 0 &&
           route->points[piece->point[e]].place->link != route->wraps[piece->wrap].link;
}

/* Length of a string that fades, with derivatives in ground; < 0: it does not fade. */
static double faded_length(const path_route *route, const route_work *work,
                           const course_piece *piece, const double *const ends[2], double *g,
                           double *pp, double *ps, double *ss) {
    const wrap_surface *surface = &route->wraps[piece->wrap].surface;
    const double *frame = work->obstacles + 12 * piece->wrap;
    const wrap_string *string = &work->strings[piece->wrap];
    int alone = route->n_wraps < 2 || work->deepest; /* else see release.c */
    int moves[2] = {alone && end_moves(route, piece, 0), alone && end_moves(route, piece, 1)};
    double p[3], s[3], transposed[9];
    if (!moves[0] && !moves[1] && surface->kind != MHE_OBSTACLE_CYLINDER && !string->held) {
        return -1;
    }
    wrap_string local = *string;
    into_frame(frame, ends[0], p);
    into_frame(frame, ends[1], s);
    into_frame(frame, string->a, local.a);
    into_frame(frame, string->b, local.b);
    int holds = 0;
    if (piece->joint[0] < 0 && piece->joint[1] < 0) {
        holds = HOLD_ANY | (end_moves(route, piece, 0) ? HOLD_P : 0) |
                (end_moves(route, piece, 1) ? HOLD_S : 0);
    }
    if (!wrap_fades(surface, p, s, moves, holds, &local)) {
        return -1;
    }
    for (int i = 0; i < 9; i++) {
        transposed[i] = frame[i % 3 * 3 + i / 3];
    }
    for (int k = 0; k < 2; k++) {
        rotate3(transposed, string->t[k], local.t[k]);
        rotate3(transposed, string->n[k], local.n[k]);
    }
    double length = wrap_faded(surface, p, s, moves, holds, &local, g, pp, ps, ss);
    if (g != NULL) {
        rotate3(frame, g, g);
        rotate3(frame, g + 3, g + 3);
        turn_back(frame, pp);
        turn_back(frame, ps);
        turn_back(frame, ss);
    }
    return length;
}

double piece_length(const path_route *route, const route_work *work, const course_piece *piece,
                    const double *const ends[2], double *g, double *pp, double *ps, double *ss) {
    if (piece->wrap < 0 || work->state[piece->wrap] <= 0) {
        return straight_length(ends[0], ends[1], g, pp, ps, ss);
    }
    double faded = faded_length(route, work, piece, ends, g, pp, ps, ss);
    if (faded >= 0) {
        return faded;
    }
    const wrap_string *string = &work->strings[piece->wrap];
    if (g != NULL) {
        for (int i = 0; i < 3; i++) {
            g[i] = -string->t[0][i];
            g[3 + i] = string->t[1][i];
        }
        wrap_curvature(string, pp, ps, ss);
    }
    return wrap_length(string);
}
