/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* MAP_ANONYMOUS */
#include "workers.h"

#include "progress.h"
#include "rows.h"
#include "trial.h"

#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define ATTEMPTS_MAX 3

/* What a worker tells its parent, in memory that both see. */
typedef struct desk {
    atomic_int task; /* the one it is at; -1: none */
    mhe_error error; /* why it gave up */
} desk;

typedef struct board {
    atomic_int next, done, failed;
    atomic_llong solves, converged;
    volatile int32_t stop;
    desk desks[WORKERS_MAX];
} board;

typedef struct crew {
    const workers_setup *setup;
    board *board;
    pid_t pids[WORKERS_MAX];                           /* 0: none */
    int32_t again[WORKERS_MAX], attempts[WORKERS_MAX]; /* task to begin with, -1: none */
} crew;

static volatile sig_atomic_t interrupted;

static void on_interrupt(int signal_number) {
    (void)signal_number;
    interrupted = 1;
}

/* ---- a worker's side ---- */

static mhe_status append(row_writer *w, task what, const char *cells, const char *timing,
                         const char *reason, mhe_error *err) {
    const row r = {.task = what, .cells = cells, .timing = timing, .reason = reason};
    return rows_append(w, &r, err);
}

static mhe_status one_trial(const crew *c, int32_t number, row_writer *w, mhe_error *err) {
    const workers_setup *s = c->setup;
    trial_result result;
    mhi_text cells = {0}, timing = {0};
    mhe_status status =
        trial_run(s->study, s->tasks[number], s->dir, s->host, &c->board->stop, &result, err);
    if (status == MHE_OK) {
        trial_cells(&result, &cells);
        trial_timing(&result, &timing);
        status = cells.failed || timing.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                               : append(w, s->tasks[number], cells.data,
                                                        timing.data, result.reason.text, err);
    }
    if (status == MHE_OK) {
        atomic_fetch_add(&c->board->done, 1);
        atomic_fetch_add(&c->board->failed, result.failed);
        atomic_fetch_add(&c->board->solves, result.tally.n_solves);
        atomic_fetch_add(&c->board->converged, result.tally.n_converged);
    }
    mhi_text_free(&cells);
    mhi_text_free(&timing);
    trial_free(&result);
    return status;
}

static mhe_status work(const crew *c, int32_t number, mhe_error *err) {
    desk *mine = &c->board->desks[number];
    row_writer w;
    mhe_status status = rows_open(c->setup->dir, c->setup->own, number, &w, err);
    int32_t next = c->again[number];
    while (status == MHE_OK && !c->board->stop) {
        next = next >= 0 ? next : atomic_fetch_add(&c->board->next, 1);
        if (next >= c->setup->n_tasks) {
            break;
        }
        atomic_store(&mine->task, next);
        status = one_trial(c, next, &w, err);
        next = -1;
        if (status == MHE_OK) {
            atomic_store(&mine->task, -1);
        }
    }
    mhe_error ignored;
    mhe_status closed = rows_close(&w, status == MHE_OK ? err : &ignored);
    return status == MHE_OK ? closed : status;
}

static void begin_worker(const crew *c, int32_t number, pid_t parent) {
    (void)signal(SIGINT, SIG_IGN); /* the parent says when to stop */
    (void)signal(SIGTERM, SIG_DFL);
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL); /* nobody would gather what it does */
    if (getppid() != parent) {
        _exit(1);
    }
    mhe_status status = work(c, number, &c->board->desks[number].error);
    _exit(status == MHE_OK || status == MHE_E_INTERRUPTED ? 0 : 1);
}

/* ---- the parent's ---- */

static mhe_status start(crew *c, int32_t number, mhe_error *err) {
    const pid_t parent = getpid();
    atomic_store(&c->board->desks[number].task, -1);
    (void)fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0) {
        begin_worker(c, number, parent);
    }
    if (pid < 0) {
        return mhe_fail(err, MHE_E_IO, "a worker process cannot be made: %s", strerror(errno));
    }
    c->pids[number] = pid;
    return MHE_OK;
}

/* The trial that a worker died of, as a row. */
static mhe_status record_crash(crew *c, int32_t number, int32_t at, const char *how,
                               mhe_error *err) {
    trial_result none = {.failed = 1};
    mhi_text cells = {0}, timing = {0}, reason = {0};
    row_writer w;
    mhi_text_add(&reason, "the trial ended its worker by %s", how);
    trial_cells(&none, &cells);
    trial_timing(&none, &timing);
    mhe_status status = rows_open(c->setup->dir, c->setup->own, number, &w, err);
    if (status == MHE_OK) {
        status = cells.failed || timing.failed || reason.failed
                     ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                     : append(&w, c->setup->tasks[at], cells.data, timing.data, reason.data, err);
    }
    mhe_error late = {0};
    const mhe_status closed = rows_close(&w, status == MHE_OK ? err : &late);
    mhi_text_free(&cells);
    mhi_text_free(&timing);
    mhi_text_free(&reason);
    atomic_fetch_add(&c->board->done, 1);
    atomic_fetch_add(&c->board->failed, 1);
    return status == MHE_OK ? closed : status;
}

/* Makes a new worker of one that died `how`; what kills it from outside, the machine's lack of
 * memory included, is no property of its trial. */
static mhe_status after_death(crew *c, int32_t number, const char *how, int32_t from_outside,
                              mhe_error *err) {
    const int32_t at = atomic_load(&c->board->desks[number].task);
    mhe_status status = MHE_OK;
    c->attempts[number] = at == c->again[number] ? c->attempts[number] + 1 : 1;
    c->again[number] = at;
    const int32_t often = c->attempts[number] >= ATTEMPTS_MAX;
    if (at < 0 && often) {
        return mhe_fail(err, MHE_E_IO, "a worker is ended again and again by %s", how);
    }
    if (at >= 0 && (!from_outside || often)) {
        status = record_crash(c, number, at, how, err);
        c->again[number] = -1;
        c->attempts[number] = 0;
    }
    return status == MHE_OK && !c->board->stop ? start(c, number, err) : status;
}

static mhe_status judge(crew *c, int32_t number, int how, mhe_error *err) {
    const mhe_error *why = &c->board->desks[number].error;
    char text[80];
    c->pids[number] = 0;
    if (WIFSIGNALED(how)) {
        const int by = WTERMSIG(how);
        (void)snprintf(text, sizeof text, "signal %d (%s)", by, strsignal(by));
        return after_death(c, number, text, by == SIGKILL || by == SIGTERM || by == SIGHUP, err);
    }
    if (WEXITSTATUS(how) == 0) {
        return MHE_OK;
    }
    if (why->text[0] == '\0') { /* a library called exit() */
        (void)snprintf(text, sizeof text, "exit status %d", WEXITSTATUS(how));
        return after_death(c, number, text, 0, err);
    }
    *err = *why;
    return why->code != MHE_OK ? why->code : MHE_E_IO;
}

/* Looks after the workers that have ended; the number of those that run. */
static int32_t attend(crew *c, mhe_status *status, mhe_error *err) {
    int32_t running = 0;
    for (int32_t i = 0; i < c->setup->n_workers; i++) {
        int how = 0;
        if (c->pids[i] > 0 && waitpid(c->pids[i], &how, WNOHANG) == c->pids[i]) {
            mhe_error why = {0};
            mhe_status judged = judge(c, i, how, &why);
            if (judged != MHE_OK && *status == MHE_OK) {
                *status = judged;
                *err = why;
                c->board->stop = 1;
            }
        }
        running += c->pids[i] > 0;
    }
    return running;
}

static void show(const crew *c, progress *bar) {
    const workers_setup *s = c->setup;
    const int32_t done = atomic_load(&c->board->done);
    const double solves = (double)atomic_load(&c->board->solves);
    const double converged = (double)atomic_load(&c->board->converged);
    progress_update(bar, s->n_before + done,
                    "%d of %d trials  %.0f solves/s  %.2f %% converged  "
                    "%d failed",
                    (int)(s->n_before + done), (int)bar->total,
                    solves / (progress_elapsed(bar) + 1e-3),
                    solves > 0 ? 100 * converged / solves : 100.0,
                    (int)(s->n_failed_before + atomic_load(&c->board->failed)));
}

static mhe_status run_crew(crew *c, progress *bar, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < c->setup->n_workers && status == MHE_OK; i++) {
        c->again[i] = -1;
        status = start(c, i, err);
    }
    if (status != MHE_OK) {
        c->board->stop = 1;
    }
    while (attend(c, &status, err) > 0) {
        const struct timespec pause = {.tv_nsec = 20000000};
        if (interrupted) {
            c->board->stop = 1;
        }
        show(c, bar);
        (void)nanosleep(&pause, NULL);
    }
    if (status == MHE_OK && interrupted) {
        status = mhe_fail(err, MHE_E_INTERRUPTED, "interrupted");
    }
    return status;
}

mhe_status workers_run(const workers_setup *setup, workers_report *report, mhe_error *err) {
    crew c = {.setup = setup};
    progress bar;
    struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
    struct sigaction before[2];
    *report = (workers_report){0};
    void *shared =
        mmap(NULL, sizeof(board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c.board = shared;
    (void)sigaction(SIGINT, &action, &before[0]);
    (void)sigaction(SIGTERM, &action, &before[1]);
    progress_start(&bar, setup->n_before + setup->n_tasks, setup->n_before, setup->quiet);
    mhe_status status = run_crew(&c, &bar, err);
    progress_end(&bar);
    report->n_done = atomic_load(&c.board->done);
    report->n_failed = atomic_load(&c.board->failed);
    report->seconds = progress_elapsed(&bar);
    (void)sigaction(SIGINT, &before[0], NULL);
    (void)sigaction(SIGTERM, &before[1], NULL);
    (void)munmap(shared, sizeof(board));
    return status;
}
