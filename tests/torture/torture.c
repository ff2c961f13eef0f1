/* SPDX-License-Identifier: Apache-2.0 */
/* torture.c: runs a program once for every k, its k-th allocation or system call failing, and says
 * how each run ended. Good are: status 0 and the reference's results; status 1 (or 2 where a file
 * could not be read), one line that tells the reason, and no result. All else is bad: a crash, a
 * program that does not end, results that differ, an error that blames something else. Crashes and
 * words of foreign libraries that had no memory themselves are told with their name, but no fault
 * of the program.
 *
 *   torture KIND once|onwards FROM TO STEP FOLDER FAULTS.so PROGRAM ARGUMENT...
 *
 * KIND: allocation, open, read, write, rename, fsync. FROM 0: only counts. `FOLDER/reference` holds
 * what a run leaves; the arguments name the result folder as FOLDER/out. Exit status 1: something
 * bad. */
#define _GNU_SOURCE
#include "syscalls.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define PATIENCE 60 /* s */

typedef struct torture {
    const char *kind, *folder, *faults;
    int onwards, allocation;
    char *const *argv;
} torture;

typedef struct outcome {
    long count;
    int result; /* of wait */
    int timed_out;
    char line[1024]; /* the first that is no warning */
    int n_lines, n_warnings;
} outcome;

enum { SAME, TOLD, FOREIGN, MISREPORTED, DIFFERENT, SILENT, LEFT, CRASH, HANGS, N_CLASSES };
static const char *const class_names[N_CLASSES] = {
    "identical results",       "told",           "ended by a library",
    "told as something else",  "results differ", "not one line",
    "results of a failed run", "crash",          "does not end"};

static const char *in_folder(const torture *t, const char *name) {
    static char paths[4][4096];
    static int turn;
    turn = (turn + 1) % 4;
    (void)snprintf(paths[turn], sizeof paths[turn], "%s/%s", t->folder, name);
    return paths[turn];
}

static int remove_one(const char *path, const struct stat *info, int flag, struct FTW *place) {
    (void)info, (void)flag, (void)place;
    return remove(path);
}

static void remove_tree(const char *path) {
    (void)nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}

/* ---- a run ---- */

typedef struct child {
    const torture *torture;
    long k;
} child;

static void begin(const void *data) {
    const child *c = data;
    const torture *t = c->torture;
    const int out = open(in_folder(t, "stdout"), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    const int err = open(in_folder(t, "stderr"), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    (void)dup2(out, STDOUT_FILENO);
    (void)dup2(err, STDERR_FILENO);
    (void)close(out);
    (void)close(err);
    if (t->allocation) {
        char which[32];
        (void)snprintf(which, sizeof which, "%ld%s", c->k, t->onwards ? "+" : "");
        (void)setenv("TORTURE_ALLOCATION", which, 1);
        (void)setenv("TORTURE_COUNT", in_folder(t, "count"), 1);
        (void)setenv("TORTURE_TRACE", in_folder(t, "trace"), 1);
        (void)setenv("LD_PRELOAD", t->faults, 1);
    }
}

static void wait_for(pid_t process, outcome *o) {
    const struct timespec moment = {.tv_nsec = 2000000};
    for (int i = 0; i < PATIENCE * 500; i++) {
        if (waitpid(process, &o->result, WNOHANG) == process) {
            return;
        }
        (void)nanosleep(&moment, NULL);
    }
    o->timed_out = 1;
    (void)kill(process, SIGKILL);
    (void)waitpid(process, &o->result, 0);
}

static void read_lines(const torture *t, outcome *o) {
    char line[1024];
    FILE *file = fopen(in_folder(t, "stderr"), "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (strstr(line, "warning:") != NULL) {
            o->n_warnings++;
        } else if (o->n_lines++ == 0) {
            (void)snprintf(o->line, sizeof o->line, "%s", line);
            o->line[strcspn(o->line, "\n")] = '\0';
        }
    }
    if (file != NULL) {
        (void)fclose(file);
    }
}

static outcome run(const torture *t, long k) {
    outcome o = {0};
    const child c = {t, k};
    const syscalls_plan plan = {.kind = t->allocation ? NULL : t->kind,
                                .k = k,
                                .onwards = t->onwards,
                                .error = strcmp(t->kind, "write") == 0 ? ENOSPC : EIO};
    int listener = -1;
    remove_tree(in_folder(t, "out"));
    const pid_t process = syscalls_start(t->argv, begin, &c, &plan, &listener);
    if (process < 0 || (!t->allocation && listener < 0)) {
        (void)fprintf(stderr, "torture: the program cannot be started\n");
        exit(2);
    }
    if (listener >= 0) {
        o.count = syscalls_serve(listener, &plan, PATIENCE);
    }
    wait_for(process, &o);
    if (listener >= 0) {
        (void)close(listener);
    }
    if (t->allocation) {
        FILE *file = fopen(in_folder(t, "count"), "r");
        if (file != NULL) {
            (void)!fscanf(file, "%ld", &o.count);
            (void)fclose(file);
        }
    }
    read_lines(t, &o);
    return o;
}

/* ---- what came of it ---- */

static int same_file(const char *a, const char *b) {
    FILE *one = fopen(a, "r"), *two = fopen(b, "r");
    int same = one != NULL && two != NULL, c = 0;
    while (same && c != EOF) {
        c = fgetc(one);
        same = c == fgetc(two);
    }
    if (one != NULL) {
        (void)fclose(one);
    }
    if (two != NULL) {
        (void)fclose(two);
    }
    return same;
}

/* Tables without times of the run; the others are as long as the clock was. */
static int same_results(const torture *t, const char **which) {
    static const char *const names[] = {"estimates.sto",        "motion.sto",    "forces.sto",
                                        "torques.sto",          "markers.trc",   "emg.sto",
                                        "marker_residuals.sto", "estimates.csv", "config.yaml"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char reference[64], out[64];
        (void)snprintf(reference, sizeof reference, "reference/%s", names[i]);
        (void)snprintf(out, sizeof out, "out/%s", names[i]);
        *which = names[i];
        if (access(in_folder(t, reference), F_OK) == 0 &&
            !same_file(in_folder(t, reference), in_folder(t, out))) {
            return 0;
        }
    }
    *which = "summary.json";
    struct stat info;
    return stat(in_folder(t, "out/summary.json"), &info) == 0 && info.st_size > 100;
}

static int n_left;

static int count_one(const char *path, const struct stat *info, int flag, struct FTW *place) {
    (void)path, (void)info, (void)place;
    n_left += flag == FTW_F;
    return 0;
}

/* Does the line name what happened? */
static int tells(const torture *t, const char *line) {
    static const char *const reasons[] = {"Input/output error", "No space left", "cannot be"};
    if (t->allocation) {
        return strstr(line, "memory") != NULL;
    }
    for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; i++) {
        if (strstr(line, reasons[i]) != NULL) {
            return 1;
        }
    }
    return 0;
}

/* The library that asked for the first memory that it did not get; NULL: the program itself. The
 * trace's first lines are the allocator's own. */
static const char *library_without_memory(const torture *t) {
    static const char *const below[] = {"faults", "/libc.so", "/libstdc++.so", "/ld-linux"};
    static char line[1024];
    FILE *file = t->allocation ? fopen(in_folder(t, "trace"), "r") : NULL;
    const char *found = NULL;
    while (file != NULL && found == NULL && fgets(line, sizeof line, file) != NULL) {
        int skipped = 0;
        for (size_t i = 0; i < sizeof below / sizeof below[0]; i++) {
            skipped = skipped || strstr(line, below[i]) != NULL;
        }
        line[strcspn(line, "(\n")] = '\0';
        const char *slash = strrchr(line, '/');
        found = skipped ? NULL : slash == NULL ? line : slash + 1;
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return found == NULL || strncmp(found, "mhe", 3) == 0 || strncmp(found, "libmhe", 6) == 0
               ? NULL
               : found;
}

static int judge(const torture *t, const outcome *o, const char **detail) {
    *detail = o->line;
    if (o->timed_out) {
        return HANGS;
    }
    const char *library = library_without_memory(t);
    if (WIFSIGNALED(o->result)) {
        *detail = library != NULL ? library : strsignal(WTERMSIG(o->result));
        return library != NULL ? FOREIGN : CRASH;
    }
    const int status = WEXITSTATUS(o->result);
    if (status == 0) {
        return o->n_lines == 0 && same_results(t, detail) ? SAME : DIFFERENT;
    }
    if (t->allocation && status == 127) { /* as the dynamic linker ends a program within dlopen() */
        *detail = "the dynamic linker";
        return FOREIGN;
    }
    if (o->n_lines != 1 || status > 2) {
        *detail = library != NULL ? library : o->line;
        return library != NULL ? FOREIGN : SILENT;
    }
    n_left = 0;
    (void)nftw(in_folder(t, "out"), count_one, 16, FTW_PHYS);
    if (n_left > 0) {
        return LEFT;
    }
    return tells(t, o->line) && (status == 1 || !t->allocation) ? TOLD : MISREPORTED;
}

int main(int argc, char **argv) {
    if (argc < 9) {
        (void)fprintf(stderr, "usage: torture KIND once|onwards FROM TO STEP FOLDER FAULTS.so "
                              "PROGRAM ARGUMENT...\n");
        return 2;
    }
    const torture t = {.kind = argv[1],
                       .onwards = strcmp(argv[2], "onwards") == 0,
                       .allocation = strcmp(argv[1], "allocation") == 0,
                       .folder = argv[6],
                       .faults = argv[7],
                       .argv = argv + 8};
    const long from = strtol(argv[3], NULL, 10), to = strtol(argv[4], NULL, 10);
    const long step = strtol(argv[5], NULL, 10);
    if (from == 0) {
        const outcome o = run(&t, 0);
        (void)printf("%ld\n", o.count);
        return !WIFEXITED(o.result) || WEXITSTATUS(o.result) != 0;
    }
    long tally[N_CLASSES] = {0}, n = 0;
    for (long k = from; k <= to; k += step > 0 ? step : 1) {
        const outcome o = run(&t, k);
        const char *detail = "";
        const int class = judge(&t, &o, &detail);
        tally[class]++;
        n++;
        if (class > TOLD) {
            (void)printf("%s %ld %s: %s: %s\n", t.kind, k, argv[2], class_names[class], detail);
            char name[64];
            (void)snprintf(name, sizeof name, "trace.%ld", k);
            (void)rename(in_folder(&t, "trace"), in_folder(&t, name));
            (void)fflush(stdout);
        }
    }
    (void)printf("%s %s, %ld runs:", t.kind, argv[2], n);
    for (int i = 0; i < N_CLASSES; i++) {
        if (tally[i] > 0) {
            (void)printf(" %s %ld;", class_names[i], tally[i]);
        }
    }
    (void)printf("\n");
    return tally[SAME] + tally[TOLD] + tally[FOREIGN] != n;
}
