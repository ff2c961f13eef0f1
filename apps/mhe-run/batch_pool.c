/* SPDX-License-Identifier: Apache-2.0 */
/* batch_pool.c: each trial is a run of this program in a process of its own, so that one that
 * crashes, or takes all memory, takes no other with it. */
#define _GNU_SOURCE /* PR_SET_PDEATHSIG */
#include "batch.h"

#include "cluster.h"
#include "process.h"
#include "progress.h"

#include <errno.h>
#include <fcntl.h>
#include <mhe/outbox.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

typedef struct place { /* of one process */
    pid_t pid;         /* 0: free */
    const batch_trial *trial;
    struct timespec begun;
} place;

typedef struct pool {
    const arguments *a;
    const batch *b;
    const char *program;
    place places[BATCH_WORKERS_MAX];
    int32_t n_places, n_done, n_failed;
} pool;

static volatile sig_atomic_t interrupted;

static void on_interrupt(int number) {
    (void)number;
    interrupted = 1;
}

static const char *log_of(pool *p, const batch_trial *t, mhi_arena *arena) {
    return mhi_arena_format(arena, "%s/%s/log.txt", p->b->dir, t->name);
}

/* The child's side. */
static void become(const char *const *argv, const char *log, pid_t parent) {
    const int out = open(log, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    (void)signal(SIGINT, SIG_IGN); /* the parent hands on what ends it */
    (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (out < 0 || dup2(out, STDOUT_FILENO) < 0 || dup2(out, STDERR_FILENO) < 0 ||
        getppid() != parent) {
        _exit(1);
    }
    union {
        const char *const *lent;
        char *const *taken;
    } words = {.lent = argv}; /* execv does not change them */
    (void)execv(argv[0], words.taken);
    _exit(127);
}

static mhe_status start(pool *p, place *at, const batch_trial *t, mhe_error *err) {
    mhi_arena arena = {0};
    mhe_outbox *folder = NULL;
    const char *out = mhi_arena_format(&arena, "%s/%s", p->b->dir, t->name);
    const char *log = log_of(p, t, &arena);
    const char **argv = MHI_TAKE(&arena, const char *, 8 + 2 * t->n_set);
    int32_t n = 0;
    if (out == NULL || log == NULL || argv == NULL) {
        mhi_arena_free(&arena);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    argv[n++] = p->program;
    argv[n++] = t->config;
    argv[n++] = "--out";
    argv[n++] = out;
    argv[n++] = "--quiet";
    if (p->a->trust) {
        argv[n++] = "--trust";
    }
    for (int32_t i = 0; i < t->n_set; i++) {
        argv[n++] = "--set";
        argv[n++] = t->set[i];
    }
    mhe_status status = mhe_outbox_open(out, &folder, err);
    const pid_t parent = getpid();
    (void)fflush(NULL);
    at->pid = status == MHE_OK ? fork() : 0;
    if (status == MHE_OK && at->pid == 0) {
        become(argv, log, parent);
    }
    if (at->pid < 0) {
        at->pid = 0;
        status = mhe_fail(err, MHE_E_IO, "a process cannot be made: %s", strerror(errno));
    }
    mhe_outbox_close(folder);
    at->trial = t;
    (void)clock_gettime(CLOCK_MONOTONIC, &at->begun);
    mhi_arena_free(&arena);
    return status;
}

/* The last line of the log that tells of an end. */
static void read_message(pool *p, const batch_trial *t, char message[1024]) {
    mhi_arena arena = {0};
    const char *log = log_of(p, t, &arena);
    FILE *file = log == NULL ? NULL : fopen(log, "r");
    char line[1024];
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (line[0] != '\0') {
            (void)snprintf(message, 1024, "%s", line);
        }
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    mhi_arena_free(&arena);
}

static mhe_status note_end(pool *p, place *at, int how, mhe_error *err) {
    struct timespec now;
    batch_end end = {.digest = at->trial->digest,
                     .status = WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how)};
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    end.seconds =
        (double)(now.tv_sec - at->begun.tv_sec) + 1e-9 * (double)(now.tv_nsec - at->begun.tv_nsec);
    at->pid = 0;
    if (interrupted) { /* not its own end: it is run again */
        return MHE_OK;
    }
    if (WIFSIGNALED(how)) {
        (void)snprintf(end.message, sizeof end.message, "ended by signal %d (%s)", WTERMSIG(how),
                       strsignal(WTERMSIG(how)));
    } else if (end.status != 0) {
        read_message(p, at->trial, end.message);
    }
    p->n_done++;
    p->n_failed += end.status != 0;
    return batch_end_write(p->b, at->trial, &end, err);
}

static int32_t attend(pool *p, mhe_status *status, mhe_error *err) {
    int32_t running = 0;
    for (int32_t i = 0; i < p->n_places; i++) {
        place *at = &p->places[i];
        int how = 0;
        if (at->pid > 0 && interrupted) {
            (void)kill(at->pid, SIGTERM);
        }
        if (at->pid > 0 && waitpid(at->pid, &how, WNOHANG) == at->pid) {
            mhe_error why = {0};
            const mhe_status noted = note_end(p, at, how, &why);
            if (noted != MHE_OK && *status == MHE_OK) {
                *status = noted;
                *err = why;
            }
        }
        running += at->pid > 0;
    }
    return running;
}

static place *free_place(pool *p) {
    for (int32_t i = 0; i < p->n_places; i++) {
        if (p->places[i].pid == 0) {
            return &p->places[i];
        }
    }
    return NULL;
}

static mhe_status run_all(pool *p, const batch_trial *const *trials, int32_t n, progress *bar,
                          mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t next = 0, running = 0; next < n || running > 0;) {
        place *at = free_place(p);
        if (next < n && at != NULL && status == MHE_OK && !interrupted) {
            status = start(p, at, trials[next++], err);
        }
        running = attend(p, &status, err);
        if ((status != MHE_OK || interrupted) && running == 0) {
            break;
        }
        progress_update(bar, p->n_done, "%d of %d trials  %d failed", (int)p->n_done, (int)n,
                        (int)p->n_failed);
        if (next == n || running == p->n_places || status != MHE_OK || interrupted) {
            const struct timespec pause = {.tv_nsec = interrupted ? 200000000 : 20000000};
            (void)nanosleep(&pause, NULL);
        }
    }
    return status == MHE_OK && interrupted
               ? mhe_fail(err, MHE_E_INTERRUPTED,
                          "interrupted; %d of %d trials are done, the same command does the rest",
                          (int)p->n_done, (int)n)
               : status;
}

mhe_status batch_work(const arguments *a, const batch *b, const batch_trial *const *trials,
                      int32_t n, mhe_error *err) {
    const struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
    const int32_t wanted = a->n_workers > 0 ? a->n_workers : cluster_processors(BATCH_WORKERS_MAX);
    struct sigaction before[2];
    mhi_arena arena = {0};
    pool p = {.a = a, .b = b, .n_places = wanted < n ? wanted : n};
    progress bar;
    mhe_status status = process_beside("mhe-run", &arena, &p.program, err);
    if (status == MHE_OK) {
        (void)sigaction(SIGINT, &action, &before[0]);
        (void)sigaction(SIGTERM, &action, &before[1]);
        progress_start(&bar, n, 0, a->quiet);
        status = run_all(&p, trials, n, &bar, err);
        progress_end(&bar);
        (void)sigaction(SIGINT, &before[0], NULL);
        (void)sigaction(SIGTERM, &before[1], NULL);
    }
    mhi_arena_free(&arena);
    return status;
}
