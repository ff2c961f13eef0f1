/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/estimator_private.h"

#include "base/values.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Times the usual work of a frame, preparation included: with the prediction that may follow and
 * what units of hard frames take longer about nine in processor time. */
#define SOLVE 6.7
/* Ahead of a frame there is time, but with a deadline the next one must not wait. */
#define PREPARE 20.0
#define PREPARE_BY_CLOCK 8.0
#define PREDICT 0.8
#define POSTURES 0.5 /* of what is left, to search postures */
/* A solution of a linear system over all intervals (mhe_solve_control.spent), of each of them, in
 * units of work: as an acceleration of the arm takes 1 us, with derivatives 3.3, a solution for
 * seven 6. */
#define SOLUTION 1.6
/* The first window starts from far and has no frame before it: this much, of each interval; good
 * recordings take a third of it, as a rule. Where the integrator needs more than PLAIN for an
 * interval (finer steps, states of muscles) it is more, up to DEARER times. What is not found by
 * then the frames behind it go on looking for, in slices of what there is for LATER; when that is
 * used up, too, the beginning rests: each frame takes one look and gives back a little, and when
 * WAKE is there (after 133 frames at most) the window begins anew from its measurements. So a
 * beginning that takes long takes several frames, a recording that goes wrong at first is not lost,
 * and one that is wrong costs little. Where muscles have states of their own (tendons, whose
 * lengths nothing measures) all of it is STATES times as much: their first windows take up to four
 * times the iterations. A settled window whose usual frame is not known yet may take LEAST in any
 * case. All of them are parts of the first. */
#define FIRST 12000.0
#define PLAIN 40.0
#define DEARER 4.0
#define STATES 4.0
#define LATER 0.5
#define SLICE 0.05
#define REFILL 0.0015
#define WAKE 0.2
#define LEAST 0.008
/* Usual is at most this many times the least median that ever was: hard data must not raise their
 * own limit. */
#define DRIFT 1.5
#define KNOWN 5 /* frames that make a usual one */
/* Of the time to a deadline: what lies between an evaluation that ends late and the estimate. */
#define GRACE 1.03

/* What is granted to the next frame decides over its preparation, too. */
int32_t mhi_pace_by_clock(const mhe_estimator *e) {
    return e->pace.is_granted    ? e->pace.granted.by_clock
           : e->pace.looks.obeys ? e->pace.looks.grant.by_clock
                                 : e->pace.budget > 0;
}

int32_t mhi_pace_late(void *estimator, double seconds) {
    mhe_estimator *e = estimator;
    const mhi_pace *p = &e->pace;
    return mhi_looks_late(&e->pace.looks, p->arrival + p->part * p->budget, seconds,
                          mhi_ocp_work(e->ocp));
}

static int32_t look(void *estimator) {
    return mhi_pace_late(estimator, 0);
}

static double first_work(const mhe_estimator *e) {
    const int32_t own = mhi_system_face(e->system)->n_z > 0;
    return (own ? STATES : 1) * FIRST * e->window.n;
}

void mhi_pace_create(mhe_estimator *e) {
    mhi_pace *p = &e->pace;
    p->all_first = p->first = first_work(e);
    p->later = LATER * p->all_first;
}

void mhi_pace_measure(mhe_estimator *e) {
    mhi_pace *p = &e->pace;
    const int64_t before = mhi_work_done(mhi_ocp_work(e->ocp));
    if (p->n_frames > 0 || p->all_first > first_work(e)) {
        return;
    }
    mhi_pace_tick(e);
    (void)mhi_ocp_predict(e->ocp, 0, e->window.guess_x, e->window.guess_u, e->window.solution.x,
                          NULL);
    const double taken = (double)(mhi_work_done(mhi_ocp_work(e->ocp)) - before);
    const double times = fmin(fmax(taken / PLAIN, 1), DEARER);
    p->first += (times - 1) * p->all_first;
    p->all_first *= times;
    p->later *= times;
    if (!mhi_pace_by_clock(e)) { /* the frame in work takes part in it */
        int64_t more = (int64_t)((times - 1) * p->all_first / times);
        mhi_work_return(mhi_ocp_work(e->ocp), &more);
    }
}

static double first_share(const mhe_estimator *e) {
    const mhi_pace *p = &e->pace;
    const double least = mhi_phase_settled(e) ? LEAST * p->all_first : 1;
    return p->rests ? least : fmax(fmax(p->first, least), fmin(SLICE * p->all_first, p->later));
}

static void wake(mhi_pace *p) {
    if (p->rests && p->later >= WAKE * p->all_first) {
        p->first = p->later;
        p->later = p->rests = 0;
        p->woken = 1;
    }
}

int32_t mhi_pace_wakes(mhe_estimator *e) {
    const int32_t woken = e->pace.woken;
    e->pace.woken = 0;
    return woken;
}

static void begin_work(mhe_estimator *e, double most) {
    mhi_work_begin(mhi_ocp_work(e->ocp), (int64_t)most, 0);
}

void mhi_pace_begin(mhe_estimator *e) {
    mhi_pace *p = &e->pace;
    p->settled = mhi_phase_settled(e);
    p->part = 1;
    mhi_work *work = mhi_ocp_work(e->ocp);
    const int32_t timed = mhi_pace_by_clock(e), obeys = p->is_granted;
    if (timed) {
        mhi_work_begin(work, 0, obeys ? 0 : p->arrival + GRACE * p->budget);
        work->look = look;
        work->looker = e;
    } else {
        wake(p);
        begin_work(e, p->usual > 0 ? SOLVE * p->usual : first_share(e));
    }
    mhi_looks_begin(&p->looks, obeys ? &p->granted : NULL, timed, work);
    p->is_granted = 0;
}

void mhi_pace_predict(mhe_estimator *e) {
    const mhi_pace *p = &e->pace;
    if (!mhi_pace_by_clock(e)) {
        begin_work(e, PREDICT * (p->usual > 0 ? p->usual : LEAST * p->all_first));
    }
}

void mhi_pace_postures(mhe_estimator *e, int32_t begun) {
    mhi_work *work = mhi_ocp_work(e->ocp);
    int64_t moved = e->pace.kept;
    if (begun) {
        e->pace.kept = (int64_t)((1 - POSTURES) * (double)(work->most - mhi_work_done(work)));
        moved = -e->pace.kept;
    }
    mhi_work_return(work, &moved);
}

void mhi_pace_part(mhe_estimator *e, double part) {
    e->pace.part = part;
}

int32_t mhi_pace_over(mhe_estimator *e) {
    return mhi_work_spent(mhi_ocp_work(e->ocp));
}

int32_t mhi_pace_spent(void *estimator, int32_t solutions) {
    mhe_estimator *e = estimator;
    mhi_work *work = mhi_ocp_work(e->ocp);
    int64_t done = -(int64_t)(SOLUTION * solutions * e->window.n);
    mhi_work_return(work, &done);
    return mhi_work_spent(work);
}

void mhi_pace_prepare(mhe_estimator *e) {
    const double usual = e->pace.usual, times = mhi_pace_by_clock(e) ? PREPARE_BY_CLOCK : PREPARE;
    begin_work(e, usual > 0 ? times * usual : first_share(e));
}

void mhi_pace_prepared(mhe_estimator *e, double seconds) {
    e->pace.ahead += seconds;
    e->pace.prepared += (double)mhi_work_done(mhi_ocp_work(e->ocp));
}

void mhi_pace_tick(mhe_estimator *e) {
    if (mhi_ocp_work(e->ocp)->look != NULL) {
        (void)look(e);
    }
}

void mhi_pace_solved(mhe_estimator *e) {
    mhi_work *work = mhi_ocp_work(e->ocp);
    e->pace.over = mhi_pace_over(e);
    if (mhi_work_is_refused(work)) { /* some intervals had been done by then, who knows which */
        mhi_ocp_forget(e->ocp);
    }
    work->deadline = 0;
    work->look = NULL;
    atomic_store_explicit(&work->refused, 0, memory_order_relaxed);
}

static void learn(mhi_pace *p, double work) {
    double sorted[MHI_PACE_FRAMES];
    p->frames[p->next] = work;
    p->next = (p->next + 1) % MHI_PACE_FRAMES;
    p->n_frames += p->n_frames < MHI_PACE_FRAMES;
    const int32_t n = p->n_frames;
    memcpy(sorted, p->frames, sizeof sorted);
    mhi_sort(sorted, n);
    if (n >= KNOWN) {
        const double median = sorted[n / 2];
        p->least = p->usual == 0 ? median : fmin(p->least, median);
        p->usual = fmin(median, DRIFT * p->least);
    }
}

/* What a frame without a usual one before it leaves to the others. */
static void spend(mhe_estimator *e, double work) {
    mhi_pace *p = &e->pace;
    p->later =
        p->rests ? p->later + REFILL * p->all_first : fmax(p->later - fmax(work - p->first, 0), 0);
    p->first = fmax(p->first - work, 0);
    if (p->first == 0 && p->later < SLICE * p->all_first && !mhi_phase_settled(e)) {
        p->rests = 1;
    }
}

/* Nothing is told of a first window that took its time and settled. */
static void tell_first(mhe_estimator *e) {
    char line[256 + MHI_UNMET_TEXT];
    const char *why = e->unmet.now;
    e->pace.first_told = 1;
    (void)snprintf(
        line, sizeof line,
        "from %.6g s on the first window found no motion that fits within the work it may "
        "take%s%s%s; estimates go on from what there is. Do the bounds, and the recording's units, "
        "axes and labels, fit the model?",
        e->window.times[0], *why != '\0' ? " (" : "", why, *why != '\0' ? ")" : "");
    e->host->log(e->host, MHE_LOG_WARNING, line);
}

void mhi_pace_end(mhe_estimator *e, int32_t frame_status) {
    mhi_pace *p = &e->pace;
    const double work = (double)mhi_work_done(mhi_ocp_work(e->ocp)) + p->prepared;
    const int32_t converged = frame_status == MHE_FRAME_OK && p->settled;
    const int32_t ended =
        converged || (frame_status == MHE_FRAME_ITERATION_LIMIT && p->settled && !p->over);
    if (p->usual == 0 && !mhi_pace_by_clock(e)) {
        spend(e, work);
        if (p->rests && !p->first_told) {
            tell_first(e);
        }
    }
    if (converged || (ended && !p->has_converged)) {
        p->has_converged |= converged;
        learn(p, work);
    }
    p->ahead = p->prepared = 0;
}
