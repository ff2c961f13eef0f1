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

static mhe_status take_look(mhi_offset_look *look, int32_t n, int32_t n_q, mhi_arena *arena,
                            mhe_error *err) {
    const mhi_room rooms[] = {{&look->q, n_q},          {&look->measured, n},
                              {&look->left, n},         {&look->weight, n},
                              {&look->follow, n_q * n}, {&look->jacobian, n * n_q}};
    return MHI_TAKE_ROOMS(arena, rooms, err);
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
    const mhi_room rooms[] = {{&o->value, n},
                              {&o->rotation, (ptrdiff_t)(nodes + 1) * n_k * 9},
                              {&o->follow, (ptrdiff_t)nodes * n_q * n},
                              {&o->normal, n * n},
                              {&o->right, n},
                              {&o->work, n * n},
                              {&o->change, n},
                              {&o->marker, n},
                              {&o->slope, n * n_q},
                              {&o->body, 12 * d->n_bodies},
                              {&o->square, n_q * n_q},
                              {&o->column, n_q},
                              {&o->step, n_q}};
    mhe_status status = MHI_TAKE_ROOMS(arena, rooms, err);
    if (status == MHE_OK) {
        status = take_look(&o->now, n, n_q, arena, err);
    }
    for (int32_t i = 0; i < MHI_OFFSET_LOOKS && status == MHE_OK; i++) {
        status = take_look(&o->looks[i], n, n_q, arena, err);
    }
    if (status == MHE_OK) {
        o->sd = sd;
        for (int32_t k = 0; k < nodes; k++) {
            mhi_offsets_forget(o, k);
        }
    }
    return status;
}

static double *rotation(const mhi_offsets *o, int32_t k) {
    return o->rotation + (ptrdiff_t)k * o->n_k * 9;
}

static double *follow(const mhi_offsets *o, int32_t k) {
    return o->follow + (ptrdiff_t)k * o->n_q * o->n;
}

void mhi_offsets_forget(mhi_offsets *o, int32_t k) {
    if (o->sd > 0) {
        rotation(o, k)[0] = NAN;
        memset(follow(o, k), 0, sizeof(double) * (size_t)(o->n_q * o->n));
    }
}

void mhi_offsets_shift(mhi_offsets *o) {
    if (o->sd > 0) {
        const size_t rest = sizeof(double) * (size_t)(o->nodes - 1);
        memmove(o->rotation, rotation(o, 1), rest * (size_t)(o->n_k * 9));
        memmove(o->follow, follow(o, 1), rest * (size_t)(o->n_q * o->n));
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
    if (rotate(o, q, rotation(o, k)) != MHE_OK) {
        rotation(o, k)[0] = NAN;
    }
}

void mhi_offsets_correct(const mhi_offsets *o, int32_t k, const double *markers, double *out) {
    const double *r = rotation(o, k);
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
        double *slope = look->jacobian + (ptrdiff_t)row * n_q;
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

/* -(J^T W J)^-1 J^T W. What no marker shows stays as it is. */
static int32_t find_follow(mhi_offsets *o, mhi_offset_look *look) {
    const int32_t n_q = o->n_q, n = o->n;
    double *square = o->square, largest = 1e-12;
    memset(square, 0, sizeof *square * (size_t)(n_q * n_q));
    for (int32_t i = 0; i < n; i++) {
        const double *row = look->jacobian + (ptrdiff_t)i * n_q;
        for (int32_t a = 0; a < n_q; a++) {
            for (int32_t b = 0; b <= a && row[a] != 0; b++) {
                square[a * n_q + b] += look->weight[i] * row[a] * row[b];
            }
        }
    }
    for (int32_t a = 0; a < n_q; a++) {
        largest = fmax(largest, square[a * n_q + a]);
    }
    for (int32_t a = 0; a < n_q; a++) {
        square[a * n_q + a] += 1e-6 * largest;
    }
    if (mhi_cholesky_factor(square, n_q) != 0) {
        return 0;
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t a = 0; a < n_q; a++) {
            o->column[a] = -look->weight[i] * look->jacobian[(ptrdiff_t)i * n_q + a];
        }
        mhi_cholesky_solve(square, n_q, o->column, 1);
        for (int32_t a = 0; a < n_q; a++) {
            look->follow[(ptrdiff_t)a * n + i] = o->column[a];
        }
    }
    return 1;
}

/* Looks at the measured markers from the posture, with the bodies' axes r [n_k x 9]. 0: it cannot.
 */
static int32_t look_from(mhi_offsets *o, mhi_offset_look *look, double *r) {
    if (rotate(o, look->q, r) != MHE_OK ||
        mhi_system_markers(o->context, look->q, o->marker, o->slope, NULL) != MHE_OK) {
        return 0;
    }
    for (int32_t i = 0; i < o->n_k; i++) {
        turn_rows(o, look, i, r + 9 * i);
    }
    return find_follow(o, look);
}

/* A look into the normal equations (`sign` 1), or out of them (-1): W P, where P = I + J follow. */
static void count_look(mhi_offsets *o, const mhi_offset_look *look, double sign) {
    const int32_t n = o->n, n_q = o->n_q;
    double *projection = o->change;
    for (int32_t i = 0; i < n; i++) {
        const double *slope = look->jacobian + (ptrdiff_t)i * n_q;
        const double weight = sign * look->weight[i];
        double right = 0;
        if (weight == 0) {
            continue;
        }
        memset(projection, 0, sizeof(double) * (size_t)n);
        projection[i] = 1;
        for (int32_t a = 0; a < n_q; a++) {
            const double *go = look->follow + (ptrdiff_t)a * n;
            for (int32_t j = 0; j < n && slope[a] != 0; j++) {
                projection[j] += slope[a] * go[j];
            }
        }
        for (int32_t j = 0; j < n; j++) {
            o->normal[(ptrdiff_t)i * n + j] += weight * projection[j];
            right += projection[j] * look->left[j];
        }
        o->right[i] += weight * right;
        o->squares += weight * right * look->left[i];
        o->rows += sign;
    }
}

/* How far a look's posture is from the nearest one with today's offsets -> step; the farthest. */
static double find_step(const mhi_offsets *o, const mhi_offset_look *look, double *step) {
    double farthest = 0;
    for (int32_t a = 0; a < o->n_q; a++) {
        const double *go = look->follow + (ptrdiff_t)a * o->n;
        step[a] = 0;
        for (int32_t i = 0; i < o->n; i++) {
            step[a] += go[i] * (o->value[i] - look->left[i]);
        }
        farthest = fmax(farthest, fabs(step[a]));
    }
    return farthest;
}

/* One of the looks again, from the nearest posture with today's offsets. */
static void look_again(mhi_offsets *o) {
    mhi_offset_look *look = &o->looks[o->next % o->n_looks];
    o->next = (o->next + 1) % o->n_looks;
    if (!(find_step(o, look, o->step) < FARTHEST)) {
        return;
    }
    count_look(o, look, -1);
    for (int32_t a = 0; a < o->n_q; a++) {
        look->q[a] += o->step[a];
    }
    if (!look_from(o, look, rotation(o, o->nodes))) { /* room of its own behind the nodes' */
        memset(look->weight, 0, sizeof(double) * (size_t)o->n);
    }
    count_look(o, look, 1);
}

static void swap(mhi_offset_look *a, mhi_offset_look *b) {
    const mhi_offset_look kept = *a;
    *a = *b;
    *b = kept;
}

/* Room for one more: every second one of the old ones goes. */
static void thin_out(mhi_offsets *o) {
    int32_t kept = 0;
    if (o->n_looks < MHI_OFFSET_LOOKS) {
        return;
    }
    for (int32_t i = 0; i < o->n_looks; i++) {
        if (i % 2 == 0) {
            count_look(o, &o->looks[i], -1);
        } else {
            swap(&o->looks[kept++], &o->looks[i]);
        }
    }
    o->n_looks = kept;
}

static int32_t is_news(const mhi_offsets *o) {
    const double *last = o->n_looks > 0 ? o->looks[o->n_looks - 1].q : NULL;
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
    double squares = o->squares;
    for (int32_t i = 0; i < o->n; i++) {
        double row = 0;
        for (int32_t j = 0; j < o->n; j++) {
            row += o->normal[(ptrdiff_t)i * o->n + j] * o->value[j];
        }
        squares += o->value[i] * (row - 2 * o->right[i]);
    }
    const double over = fmax(0, o->rows - o->n_q * o->n_looks - o->n);
    return (o->n * first * first + ALIKE * fmax(0, squares)) / (o->n + over);
}

/* A step towards the offsets that are likeliest, with their change. */
static void solve(mhi_offsets *o) {
    const ptrdiff_t n = o->n;
    const double says = 1 / noise(o), expected = 1 / (o->sd * o->sd);
    for (ptrdiff_t i = 0; i < n * n; i++) {
        o->work[i] = says * o->normal[i];
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        o->work[i * n + i] += (1 + DAMPING) * expected;
        o->change[i] = says * o->right[i] + DAMPING * expected * o->value[i];
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
static void move_postures(const mhi_offsets *o, int32_t k, double *q) {
    for (int32_t m = 0; m <= k; m++) {
        for (int32_t a = 0; a < o->n_q; a++) {
            const double *go = follow(o, m) + (ptrdiff_t)a * o->n;
            double move = 0;
            for (int32_t i = 0; i < o->n; i++) {
                move += go[i] * o->change[i];
            }
            q[(ptrdiff_t)m * o->n_q + a] += move;
        }
    }
}

void mhi_offsets_learn(mhi_offsets *o, int32_t k, const double *markers, double *q) {
    const size_t n_q = (size_t)o->n_q, n = (size_t)o->n;
    memcpy(o->now.q, q + (ptrdiff_t)k * o->n_q, sizeof(double) * n_q);
    memcpy(o->now.measured, markers, sizeof(double) * n);
    if (!look_from(o, &o->now, rotation(o, k))) {
        mhi_offsets_forget(o, k);
        return;
    }
    memcpy(follow(o, k), o->now.follow, sizeof(double) * n_q * n);
    if (o->n_looks > 0) {
        look_again(o);
    }
    if (is_news(o)) {
        thin_out(o);
        count_look(o, &o->now, 1);
        swap(&o->now, &o->looks[o->n_looks++]);
    }
    solve(o);
    move_postures(o, k, q);
}

void mhi_offsets_hold(mhi_offsets *o, int32_t k, int32_t coordinate) {
    if (o->sd > 0) {
        memset(follow(o, k) + (ptrdiff_t)coordinate * o->n, 0, sizeof(double) * (size_t)o->n);
    }
}
