/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/offsets.h"

#include "base/cholesky.h"

#include <math.h>
#include <string.h>

/* What a look is off by, of the offset expected, before the looks themselves tell: as much as a
 * marker's worth of them says. */
#define FIRST_NOISE 0.1
/* Looks follow each other within tenths of a second, in which skin is moved alike: so many say as
 * much as one. */
#define ALIKE 10
/* A posture is looked at that is as far from the last one looked at, rad or m. */
#define NEWS 0.05
/* A look's posture does not move by more at once, rad or m. */
#define FARTHEST 0.5
/* Each node is a step of Gauss and Newton towards the least offsets, held back as much as if so
 * many markers had been seen where the offsets are now: looks from postures that are still off are
 * not to throw them far. */
#define DAMPING 5

static mhe_status take_nodes(mhi_offsets *o, mhi_arena *arena, mhe_error *err) {
    o->node = MHI_TAKE(arena, mhi_offset_node, o->nodes);
    mhe_status status = o->node == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (int32_t k = 0; k < o->nodes && status == MHE_OK; k++) {
        mhi_offset_node *node = &o->node[k];
        node->rotation = MHI_TAKE(arena, double, o->n_k * 9);
        node->held = MHI_TAKE(arena, int32_t, o->n_q);
        status = node->rotation == NULL || node->held == NULL
                     ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                     : mhi_offset_follow_create(&node->follow, o->n, o->n_q, arena, err);
    }
    return status;
}

mhe_status mhi_offsets_create(mhi_offsets *o, double sd, const mhi_system *system,
                              mhi_system_context *context, const mhi_tasks *tasks, int32_t nodes,
                              mhi_arena *arena, mhe_error *err) {
    const mhe_description *d = mhi_system_description(system);
    const int32_t n_q = mhi_system_face(system)->n_q, n_k = d->n_markers, n = 3 * n_k;
    *o = (mhi_offsets){.n_q = n_q,
                       .n_k = n_k,
                       .n = n,
                       .nodes = nodes,
                       .description = d,
                       .context = context,
                       .tasks = tasks};
    if (sd == 0 || n_k == 0) {
        return MHE_OK;
    }
    const mhi_room rooms[] = {{&o->value, n},          {&o->sum.normal, n * n},
                              {&o->sum.right, n},      {&o->work, n * n},
                              {&o->change, n + n_q},   {&o->marker, n},
                              {&o->slope, n * n_q},    {&o->jacobian, n * n_q},
                              {&o->rotation, n_k * 9}, {&o->body, 12 * d->n_bodies},
                              {&o->step, n_q}};
    mhe_status status = MHI_TAKE_ROOMS(arena, rooms, err);
    if (status == MHE_OK) {
        status = take_nodes(o, arena, err);
    }
    if (status == MHE_OK) {
        status = mhi_offset_look_create(&o->now, n, n_q, arena, err);
    }
    for (int32_t i = 0; i < MHI_OFFSET_LOOKS && status == MHE_OK; i++) {
        status = mhi_offset_look_create(&o->looks[i], n, n_q, arena, err);
    }
    if (status == MHE_OK) {
        o->sd = sd;
        for (int32_t k = 0; k < nodes; k++) {
            mhi_offsets_forget(o, k);
        }
    }
    return status;
}

void mhi_offsets_forget(mhi_offsets *o, int32_t k) {
    if (o->sd > 0) {
        o->node[k].rotation[0] = NAN;
        o->node[k].follow.known = 0;
        memset(o->node[k].held, 0, sizeof(int32_t) * (size_t)o->n_q);
    }
}

void mhi_offsets_shift(mhi_offsets *o) {
    if (o->sd > 0) {
        const mhi_offset_node first = o->node[0];
        memmove(o->node, o->node + 1, sizeof first * (size_t)(o->nodes - 1));
        o->node[o->nodes - 1] = first;
        mhi_offsets_forget(o, o->nodes - 1);
    }
}

/* Of the markers' bodies in the posture q -> to [n_k x 9]. */
static mhe_status rotate(mhi_offsets *o, const double *q, double *to) {
    static const double none[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const mhe_status status = mhi_system_bodies(o->context, q, o->body, NULL, NULL);
    for (int32_t i = 0; i < o->n_k && status == MHE_OK; i++) {
        const int32_t body = o->description->markers[i].body;
        memcpy(to + 9 * i, body < 0 ? none : o->body + 12 * body + 3, sizeof none);
    }
    return status;
}

void mhi_offsets_turn(mhi_offsets *o, int32_t k, const double *q) {
    double *r = o->node[k].rotation;
    if (rotate(o, q, r) != MHE_OK) {
        r[0] = NAN;
    }
}

void mhi_offsets_correct(const mhi_offsets *o, int32_t k, const double *markers, double *out) {
    const double *r = o->node[k].rotation;
    for (int32_t i = 0; i < o->n_k; i++) {
        const double *b = o->value + 3 * i, *a = r + 9 * i;
        for (int32_t j = 0; j < 3; j++) {
            const double off =
                isnan(r[0]) ? 0 : a[3 * j] * b[0] + a[3 * j + 1] * b[1] + a[3 * j + 2] * b[2];
            out[3 * i + j] = markers[3 * i + j] - off;
        }
    }
}

/* A marker's rows of what is left and of its slopes, from ground to its body's axes. */
static void turn_rows(mhi_offsets *o, mhi_offset_look *look, int32_t i, const double *r) {
    const double *y = look->measured + 3 * i, *p = o->marker + 3 * i;
    const int32_t n_q = o->n_q, there = !isnan(y[0] + y[1] + y[2]);
    const double weight = !there ? 0 : o->tasks == NULL ? 1 : o->tasks->marker[i];
    for (int32_t j = 0; j < 3; j++) {
        const int32_t row = 3 * i + j;
        double *slope = o->jacobian + (ptrdiff_t)row * n_q;
        memset(slope, 0, sizeof *slope * (size_t)n_q);
        look->left[row] = 0;
        look->weight[row] = weight;
        for (int32_t l = 0; l < 3 && weight > 0; l++) {
            const double *from = o->slope + (ptrdiff_t)(3 * i + l) * n_q;
            look->left[row] += r[3 * l + j] * (y[l] - p[l]);
            for (int32_t c = 0; c < n_q; c++) {
                slope[c] += r[3 * l + j] * from[c];
            }
        }
    }
}

/* Looks at the measured markers from the posture, with the bodies' axes r [n_k x 9]. 0: it cannot.
 */
static int32_t look_from(mhi_offsets *o, mhi_offset_look *look, double *r) {
    look->follow.known = 0;
    if (rotate(o, look->q, r) != MHE_OK ||
        mhi_system_markers(o->context, look->q, o->marker, o->slope, NULL) != MHE_OK) {
        return 0;
    }
    for (int32_t i = 0; i < o->n_k; i++) {
        turn_rows(o, look, i, r + 9 * i);
    }
    return mhi_offset_follow_find(&look->follow, o->jacobian, look->weight, o->n, o->n_q);
}

static void count_look(mhi_offsets *o, const mhi_offset_look *look, double sign) {
    mhi_offset_look_count(look, sign, o->n, o->n_q, o->change, &o->sum);
}

/* One of the looks again, from the nearest posture with today's offsets. */
static void look_again(mhi_offsets *o) {
    mhi_offset_look *look = &o->looks[o->next % o->n_looks];
    double farthest = 0;
    o->next = (o->next + 1) % o->n_looks;
    for (int32_t i = 0; i < o->n; i++) {
        o->change[i] = o->value[i] - look->left[i];
    }
    mhi_offset_follow_move(&look->follow, o->change, o->n, o->n_q, o->step);
    for (int32_t a = 0; a < o->n_q; a++) {
        farthest = fmax(farthest, fabs(o->step[a]));
    }
    if (!(farthest < FARTHEST)) {
        return;
    }
    count_look(o, look, -1);
    for (int32_t a = 0; a < o->n_q; a++) {
        look->q[a] += o->step[a];
    }
    (void)look_from(o, look, o->rotation); /* where it cannot, nothing counts */
    count_look(o, look, 1);
}

static void swap(mhi_offset_look *a, mhi_offset_look *b) {
    const mhi_offset_look kept = *a;
    *a = *b;
    *b = kept;
}

/* How long a look has stayed beyond its time, in looks. Every look stays for 16 more, every second
 * for 32, every fourth for 48: the older, the fewer, and with each that comes just one goes. */
static int64_t overdue(const mhi_offsets *o, const mhi_offset_look *look) {
    int64_t life = 16;
    for (int64_t rest = look->number; rest % 2 == 0 && life < 80; rest /= 2) {
        life += 16;
    }
    return o->number - look->number - life;
}

/* Room for one more; where all is taken, that of the one that should have gone first. */
static int32_t make_room(mhi_offsets *o) {
    int32_t longest = 0;
    if (o->n_looks < MHI_OFFSET_LOOKS) {
        return o->n_looks++;
    }
    for (int32_t i = 1; i < o->n_looks; i++) {
        longest = overdue(o, &o->looks[i]) > overdue(o, &o->looks[longest]) ? i : longest;
    }
    count_look(o, &o->looks[longest], -1);
    return longest;
}

static void keep_look(mhi_offsets *o) {
    o->now.number = ++o->number;
    o->last = make_room(o);
    count_look(o, &o->now, 1);
    swap(&o->now, &o->looks[o->last]);
}

static int32_t is_news(const mhi_offsets *o) {
    const double *last = o->n_looks > 0 ? o->looks[o->last].q : NULL;
    int32_t news = last == NULL;
    for (int32_t a = 0; a < o->n_q && !news; a++) {
        news = fabs(o->now.q[a] - last[a]) > NEWS;
    }
    return news;
}

/* Variance of what a look says of a marker's coordinate: by what the offsets leave of all looks,
 * and at first by what is expected. Skin that moves is in it. */
static double noise(const mhi_offsets *o) {
    const double first = FIRST_NOISE * o->sd;
    const double squares = mhi_offset_sum_squares(&o->sum, o->value, o->n);
    const double over = fmax(0, o->sum.rows - o->n_q * o->n_looks - o->n);
    return (o->n * first * first + ALIKE * fmax(0, squares)) / (o->n + over);
}

/* A step towards the offsets that are likeliest, with their change. */
static void solve(mhi_offsets *o) {
    const ptrdiff_t n = o->n;
    const double says = 1 / noise(o), expected = 1 / (o->sd * o->sd);
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t j = 0; j <= i; j++) {
            o->work[i * n + j] = says * o->sum.normal[i * n + j];
        }
        o->work[i * n + i] += (1 + DAMPING) * expected;
        o->change[i] = says * o->sum.right[i] + DAMPING * expected * o->value[i];
    }
    if (mhi_cholesky_factor(o->work, o->n) != 0) {
        memset(o->change, 0, sizeof(double) * (size_t)n);
        return;
    }
    mhi_cholesky_solve(o->work, o->n, o->change, 1);
    for (ptrdiff_t i = 0; i < n; i++) {
        const double found = o->change[i];
        o->change[i] -= o->value[i];
        o->value[i] = found;
    }
}

/* The postures of the nodes until k go along. */
static void move_postures(mhi_offsets *o, int32_t k, double *q) {
    for (int32_t m = 0; m <= k; m++) {
        const mhi_offset_node *node = &o->node[m];
        mhi_offset_follow_move(&node->follow, o->change, o->n, o->n_q, o->step);
        for (int32_t a = 0; a < o->n_q; a++) {
            q[(ptrdiff_t)m * o->n_q + a] += node->held[a] ? 0 : o->step[a];
        }
    }
}

void mhi_offsets_learn(mhi_offsets *o, int32_t k, const double *markers, double *q) {
    memcpy(o->now.q, q + (ptrdiff_t)k * o->n_q, sizeof(double) * (size_t)o->n_q);
    memcpy(o->now.measured, markers, sizeof(double) * (size_t)o->n);
    if (!look_from(o, &o->now, o->node[k].rotation)) {
        mhi_offsets_forget(o, k);
        return;
    }
    mhi_offset_follow_copy(&o->node[k].follow, &o->now.follow, o->n, o->n_q);
    if (o->n_looks > 0) {
        look_again(o);
    }
    if (is_news(o)) {
        keep_look(o);
    }
    solve(o);
    move_postures(o, k, q);
}

void mhi_offsets_hold(mhi_offsets *o, int32_t k, int32_t coordinate) {
    if (o->sd > 0) {
        o->node[k].held[coordinate] = 1;
    }
}

int32_t mhi_offsets_unknown(mhi_offsets *o, const double *q, const double *markers, double *out) {
    const ptrdiff_t n = o->n, n_q = o->n_q;
    memcpy(o->now.q, q, sizeof(double) * (size_t)n_q);
    memcpy(o->now.measured, markers, sizeof(double) * (size_t)n);
    if (!look_from(o, &o->now, o->rotation)) {
        return 0;
    }
    const double says = 1 / noise(o);
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t j = 0; j <= i; j++) {
            o->work[i * n + j] = says * o->sum.normal[i * n + j];
        }
        o->work[i * n + i] += 1 / (o->sd * o->sd);
    }
    if (mhi_cholesky_factor(o->work, o->n) != 0) {
        return 0;
    }
    memcpy(o->slope, o->jacobian, sizeof(double) * (size_t)(n * n_q));
    mhi_cholesky_solve(o->work, o->n, o->slope, o->n_q);
    memset(out, 0, sizeof(double) * (size_t)(n_q * n_q));
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t a = 0; a < n_q; a++) {
            for (ptrdiff_t c = 0; c < n_q; c++) {
                out[a * n_q + c] += o->jacobian[i * n_q + a] * o->slope[i * n_q + c];
            }
        }
    }
    return 1;
}
