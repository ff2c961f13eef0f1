/* SPDX-License-Identifier: Apache-2.0 */
/* loops.c: how far loops are open, how fast, and the derivatives of both.
 *
 * A point x fixed to link i moves with x' = v + w x x and x'' = a + al x x + w x x', [w, v] and
 * [al, a] the link's velocity and acceleration, spatial in ground. Turning joint j carries x along
 * S_j, and changes (symbols of dynamics.c) d[w, v] = S_j x [w, v] + S'_j,     d[al, a] = S_j x [al,
 * a] + S''_j - [w, v] x S'_j, a change of its speed d[w, v] = S_j, d[al, a] = 2 S'_j - [w, v] x
 * S_j. */
#include "context.h"
#include "vector.h"

#include <string.h>

/* One side of a loop in ground: a frame on a link (-1: ground) and its motion. */
typedef struct side {
    int32_t link;
    double sign; /* of its share: +1 of frame 2, -1 of frame 1 */
    double r[9], x[3];
    double velocity[6], acceleration[6]; /* of the link */
    double x_rate[3];
} side;

/* Columns of one joint for three (six) rows. */
typedef struct joint_columns {
    double gap[6], rate[6], by_angle[6], by_speed[6], acceleration[6];
} joint_columns;

/* Accelerations of the links without gravity at the joints' accelerations. */
static void link_accelerations(const simbody_context *c) {
    const tree *t = c->tree;
    for (int32_t i = 0; i < t->n_joints; i++) {
        double *a = c->loop_acceleration + 6 * i;
        const int32_t parent = t->joints[i].parent;
        memset(a, 0, 6 * sizeof *a);
        if (parent >= 0) {
            memcpy(a, c->loop_acceleration + 6 * parent, 6 * sizeof *a);
        }
        add6(a, c->acceleration[i], c->links[i].axis);
        add6(a, c->speed[i], c->links[i].axis_rate);
    }
}

static side side_of(const simbody_context *c, const mhe_loop *loop, int k) {
    side s = {.link = loop->body[k] < 0 ? -1 : c->tree->bodies[loop->body[k]].link,
              .sign = k == 0 ? -1 : 1};
    double body_r[9], body_p[3], turning[3];
    bodies_pose(c, loop->body[k], body_r, body_p);
    multiply3(body_r, loop->r[k], s.r);
    place3(body_r, body_p, loop->p[k], s.x);
    if (s.link >= 0) {
        memcpy(s.velocity, c->links[s.link].velocity, sizeof s.velocity);
        memcpy(s.acceleration, c->loop_acceleration + 6 * s.link, sizeof s.acceleration);
    }
    cross3(s.velocity, s.x, turning);
    memcpy(s.x_rate, s.velocity + 3, sizeof s.x_rate);
    add3(s.x_rate, 1, turning);
    return s;
}

/* out = change of d[w, v] at x with x itself moving by dx */
static void point_rate(const side *s, const double *d, const double *dx, double *out) {
    double turning[3];
    memcpy(out, d + 3, 3 * sizeof *out);
    cross3(d, s->x, turning);
    add3(out, 1, turning);
    cross3(s->velocity, dx, turning);
    add3(out, 1, turning);
}

/* out = change of x'' by d[al, a] = a, d[w, v] = d, dx and dx' */
static void point_acceleration(const side *s, const double *a, const double *d, const double *dx,
                               const double *dx_rate, double *out) {
    double turning[3];
    memcpy(out, a + 3, 3 * sizeof *out);
    cross3(a, s->x, turning);
    add3(out, 1, turning);
    cross3(s->acceleration, dx, turning);
    add3(out, 1, turning);
    cross3(d, s->x_rate, turning);
    add3(out, 1, turning);
    cross3(s->velocity, dx_rate, turning);
    add3(out, 1, turning);
}

/* S''_j without gravity */
static void axis_second(const simbody_context *c, int32_t j, double *out) {
    static const double none[6];
    const int32_t parent = c->tree->joints[j].parent;
    double turning[6];
    cross_motion(parent < 0 ? none : c->loop_acceleration + 6 * parent, c->links[j].axis, out);
    cross_motion(parent < 0 ? none : c->links[parent].velocity, c->links[j].axis_rate, turning);
    add6(out, 1, turning);
}

/* What joint j, which carries the side's link, does to the three rows of its point and, from row 3
 * on, of its turning. */
static void joint_share(const simbody_context *c, const side *s, int32_t j, joint_columns *out) {
    const double *axis = c->links[j].axis, *axis_rate = c->links[j].axis_rate;
    static const double still[3];
    double dx[3], d[6], a[6], turned[6];
    cross3(axis, s->x, dx); /* the point itself */
    add3(dx, 1, axis + 3);
    memcpy(out->rate, dx, sizeof dx);
    memcpy(out->rate + 3, axis, 3 * sizeof *axis);
    cross_motion(axis, s->velocity, d); /* by its angle */
    add6(d, 1, axis_rate);
    cross_motion(axis, s->acceleration, a);
    axis_second(c, j, turned);
    add6(a, 1, turned);
    cross_motion(s->velocity, axis_rate, turned);
    add6(a, -1, turned);
    point_rate(s, d, dx, out->by_angle);
    memcpy(out->by_angle + 3, d, 3 * sizeof *d);
    point_acceleration(s, a, d, dx, out->by_angle, out->acceleration);
    memcpy(out->acceleration + 3, a, 3 * sizeof *a);
    cross_motion(s->velocity, axis, turned); /* by its speed */
    memset(a, 0, sizeof a);
    add6(a, 2, axis_rate);
    add6(a, -1, turned);
    point_acceleration(s, a, axis, still, dx, out->by_speed);
    memcpy(out->by_speed + 3, a, 3 * sizeof *a);
}

/* Half the sum of axis 1 x axis 2, and its change when frame k turns by w. */
static void turn_gap(const double *r1, const double *r2, double *out) {
    memset(out, 0, 3 * sizeof *out);
    for (int i = 0; i < 3; i++) {
        const double a[3] = {r1[i], r1[3 + i], r1[6 + i]}, b[3] = {r2[i], r2[3 + i], r2[6 + i]};
        double product[3];
        cross3(a, b, product);
        add3(out, 0.5, product);
    }
}

static void turn_gap_change(const double *r1, const double *r2, int k, const double *w,
                            double *out) {
    double turned[9];
    for (int i = 0; i < 3; i++) {
        const double *r = k == 0 ? r1 : r2;
        const double axis[3] = {r[i], r[3 + i], r[6 + i]};
        double moved[3];
        cross3(w, axis, moved);
        turned[i] = moved[0];
        turned[3 + i] = moved[1];
        turned[6 + i] = moved[2];
    }
    turn_gap(k == 0 ? turned : r1, k == 0 ? r2 : turned, out);
}

static void add_column(double *matrix, int32_t n_q, int32_t column, int32_t rows, double scale,
                       const double *values) {
    for (int32_t k = 0; k < rows && matrix != NULL; k++) {
        matrix[k * n_q + column] += scale * values[k];
    }
}

static double *rows_from(double *matrix, int32_t row, int32_t width) {
    return matrix == NULL ? NULL : matrix + row * width;
}

/* Adds side k to the rows from `row` on; frames r1, r2 of the loop for its turning. */
static void add_side(const simbody_context *c, const side *s, int k, const side *sides,
                     int32_t rows, int32_t row, const mhe_loop_values *out) {
    const tree *t = c->tree;
    const int32_t n_q = t->n_q;
    for (int32_t j = s->link; j >= 0; j = t->joints[j].parent) {
        const int32_t column = t->joints[j].coordinate;
        const double *f = c->slopes + 4 * j, v = c->v[column];
        const double slope = s->sign * f[1];
        const double by_q = s->sign * (f[2] * c->loop_vdot[column] + f[3] * v * v);
        joint_columns own;
        joint_share(c, s, j, &own);
        memcpy(own.gap, own.rate, 3 * sizeof *own.gap);
        turn_gap_change(sides[0].r, sides[1].r, k, c->links[j].axis, own.gap + 3);
        if (out->gap_q != NULL) { /* the turning's gap is no difference: it has no sign */
            double *gap_q = rows_from(out->gap_q, row, n_q);
            add_column(gap_q, n_q, column, 3, slope, own.gap);
            add_column(rows_from(gap_q, 3, n_q), n_q, column, rows - 3, f[1], own.gap + 3);
        }
        add_column(rows_from(out->rate_v, row, n_q), n_q, column, rows, slope, own.rate);
        double *rate_q = rows_from(out->rate_q, row, n_q);
        add_column(rate_q, n_q, column, rows, slope, own.by_angle);
        add_column(rate_q, n_q, column, rows, s->sign * f[2] * v, own.rate);
        double *acceleration_q = rows_from(out->acceleration_q, row, n_q);
        add_column(acceleration_q, n_q, column, rows, slope, own.acceleration);
        add_column(acceleration_q, n_q, column, rows, s->sign * f[2] * v, own.by_speed);
        add_column(acceleration_q, n_q, column, rows, by_q, own.rate);
        double *acceleration_v = rows_from(out->acceleration_v, row, n_q);
        add_column(acceleration_v, n_q, column, rows, slope, own.by_speed);
        add_column(acceleration_v, n_q, column, rows, s->sign * 2 * f[2] * v, own.rate);
    }
}

/* Values of one loop from row `row` on. */
static void loop_values(const side *sides, int32_t rows, int32_t row, const mhe_loop_values *out) {
    double x_acceleration[2][3];
    for (int k = 0; k < 2; k++) {
        static const double still[6];
        point_acceleration(&sides[k], sides[k].acceleration, sides[k].velocity, still, still,
                           x_acceleration[k]);
    }
    if (out->gap != NULL && rows == 6) {
        turn_gap(sides[0].r, sides[1].r, out->gap + row + 3);
    }
    for (int i = 0; i < 3; i++) {
        if (out->gap != NULL) {
            out->gap[row + i] = sides[1].x[i] - sides[0].x[i];
        }
        if (out->rate != NULL) {
            out->rate[row + i] = sides[1].x_rate[i] - sides[0].x_rate[i];
        }
        if (out->acceleration != NULL) {
            out->acceleration[row + i] = x_acceleration[1][i] - x_acceleration[0][i];
        }
        if (out->rate != NULL && rows == 6) {
            out->rate[row + 3 + i] = sides[1].velocity[i] - sides[0].velocity[i];
        }
        if (out->acceleration != NULL && rows == 6) {
            out->acceleration[row + 3 + i] = sides[1].acceleration[i] - sides[0].acceleration[i];
        }
    }
}

static void zero_matrices(const simbody_context *c, const mhe_loop_values *out) {
    double *const all[] = {out->gap_q, out->rate_q, out->rate_v, out->acceleration_q,
                           out->acceleration_v};
    const size_t n = (size_t)mhe_loop_rows(c->description) * (size_t)c->tree->n_q;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        if (all[i] != NULL) {
            memset(all[i], 0, n * sizeof *all[i]);
        }
    }
}

/* What Simbody's own constraints say, in the place of the recursion's values. */
static mhe_status take_simbody(const simbody_context *c, const mhe_loop_values *out,
                               mhe_error *err) {
    return skeleton_loops(c->skeleton, c->speed, c->acceleration, out->gap, out->rate,
                          out->acceleration, err);
}

mhe_status simbody_loops(void *context, const double *vdot, const mhe_loop_values *out,
                         mhe_error *err) {
    simbody_context *c = context;
    const tree *t = c->tree;
    if (!c->placed) {
        return mhe_fail(err, MHE_RETRY, "no state is set");
    }
    for (int32_t i = 0; i < t->n_q; i++) {
        c->loop_vdot[i] = vdot == NULL ? 0 : vdot[i];
    }
    for (int32_t i = 0; i < t->n_joints; i++) {
        const double *f = c->slopes + 4 * i, v = c->v[t->joints[i].coordinate];
        c->acceleration[i] = f[2] * v * v + f[1] * c->loop_vdot[t->joints[i].coordinate];
    }
    dynamics_velocities(t, c->speed, c->links);
    link_accelerations(c);
    zero_matrices(c, out);
    const int derivatives = out->gap_q != NULL || out->rate_q != NULL || out->rate_v != NULL ||
                            out->acceleration_q != NULL || out->acceleration_v != NULL;
    for (int32_t i = 0, row = 0; i < c->description->n_loops; i++) {
        const mhe_loop *loop = &c->description->loops[i];
        const int32_t rows = loop->kind == MHE_LOOP_WELD ? 6 : 3;
        const side sides[2] = {side_of(c, loop, 0), side_of(c, loop, 1)};
        loop_values(sides, rows, row, out);
        for (int k = 0; k < 2 && derivatives; k++) {
            add_side(c, &sides[k], k, sides, rows, row, out);
        }
        row += rows;
    }
    return c->dynamics == SIMBODY_DYNAMICS_SIMBODY ? take_simbody(c, out, err) : MHE_OK;
}
