/* SPDX-License-Identifier: Apache-2.0 */
#include "scale.h"

#include "console.h"
#include "tree_model.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define REPEATS 3

extern char **environ;

/* Muscles grow from the first to the second, coordinates from there to the fourth. */
static const tree_size sizes[] = {{20, {"3121"}},
                                  {80, {"3121"}},
                                  {80, {"t3", "3121", "31"}},
                                  {80, {"t3", "3121", "3121", "3", "3"}},
                                  {92, {"t3", "3121", "3121", "3", "3"}},
                                  {150, {"t3", "3121", "3121", "3121", "3121", "33"}}};
enum { N_SIZES = sizeof sizes / sizeof sizes[0], N_QUICK = 3 };

typedef struct row {
    int32_t coordinates, muscles;
    double frame, p99, prepare, evaluation, rest, force; /* s, the last N */
} row;

static mhe_status make_folder(const char *path, mhe_error *err) {
    char part[4096];
    for (size_t i = 1; i <= strlen(path); i++) {
        if (path[i] != '/' && path[i] != '\0') {
            continue;
        }
        (void)snprintf(part, sizeof part, "%.*s", (int)i, path);
        if (mkdir(part, 0777) != 0 && errno != EEXIST) {
            return mhe_fail(err, MHE_E_INPUT, "%s: %s", part, strerror(errno));
        }
    }
    return MHE_OK;
}

/* mhe-sim forward in the folder. */
static mhe_status simulate(const char *folder, mhe_error *err) {
    char self[4096], program[4200], config[4200], input[4200], out[4200];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    self[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(self, '/');
    (void)snprintf(program, sizeof program, "%.*s/mhe-sim", slash ? (int)(slash - self) : 0, self);
    (void)snprintf(config, sizeof config, "%s/sim.yaml", folder);
    (void)snprintf(input, sizeof input, "%s/excitations.sto", folder);
    (void)snprintf(out, sizeof out, "%s/sim", folder);
    char *const words[] = {program, "forward", config, "--input", input, "--out", out, NULL};
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    int status = 0;
    (void)posix_spawn_file_actions_init(&actions);
    (void)posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    const int failed = posix_spawn(&child, program, &actions, NULL, words, environ);
    (void)posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %s; it moves the models", program, strerror(failed));
    }
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0
               ? MHE_OK
               : mhe_fail(err, MHE_E_NUMERIC, "%s forward %s failed", program, config);
}

static mhe_status time_tree(const arguments *a, const char *folder, mhi_registry *registry,
                            const mhe_host *host, row *r, mhe_error *err) {
    static const char *const window[] = {"horizon.window=7"};
    char config[4200];
    (void)snprintf(config, sizeof config, "%s/bench.yaml", folder);
    variants v;
    bench *b = calloc(1, sizeof *b);
    if (b == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status =
        variants_read(config, a->set.values, a->set.n, window, 1, registry, &v, err);
    const bench_setup setup = {.variants = &v,
                               .host = host,
                               .repeats = a->repeats > 0 ? a->repeats : REPEATS,
                               .no_layers = 1};
    b->setup = &setup;
    if (status == MHE_OK) {
        status = bench_measure(&setup, b, err);
    }
    if (status == MHE_OK) {
        const bench_run *run = &b->runs[0];
        const bench_part *of = run->parts;
        const bench_spread *s = &of[PART_FRAME].spread;
        *r = (row){run->rig.info.n_q,
                   run->rig.info.n_muscles,
                   s->p50,
                   s->p99,
                   of[PART_PREPARE].spread.p50,
                   of[PART_EVALUATION].spread.p50,
                   of[PART_REST].spread.p50,
                   run->rig.rmse.force};
    }
    bench_free(b);
    variants_free(&v);
    free(b);
    return status;
}

static double exponent(const row *a, const row *b, int by_muscles) {
    const double grown =
        by_muscles ? (double)b->muscles / a->muscles : (double)b->coordinates / a->coordinates;
    return log(b->frame / a->frame) / log(grown);
}

static void add_exponents(const row *rows, int32_t n, mhi_text *out) {
    mhi_text_add(out, "\nexponent of the time in muscles, %d to %d at %d coordinates: %.2f\n",
                 rows[0].muscles, rows[1].muscles, rows[0].coordinates,
                 exponent(&rows[0], &rows[1], 1));
    for (int32_t i = 2; i < n && rows[i].muscles == rows[1].muscles; i++) {
        mhi_text_add(out, "in coordinates, %d to %d at %d muscles: %.2f\n", rows[1].coordinates,
                     rows[i].coordinates, rows[1].muscles, exponent(&rows[1], &rows[i], 0));
    }
}

mhe_status scale_measure(const arguments *a, mhi_registry *registry, const mhe_host *host,
                         mhe_error *err) {
    const int32_t n = a->quick ? N_QUICK : N_SIZES;
    row rows[N_SIZES];
    mhi_text text = {0};
    mhe_status status = MHE_OK;
    mhi_text_add(&text, "%11s %8s %9s %9s %9s %9s %9s %9s %9s\n", "coordinates", "muscles",
                 "frames/s", "p50 ms", "p99", "prepare", "evaluate", "rest", "force N");
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        char folder[4096];
        (void)snprintf(folder, sizeof folder, "%s/tree-%d-%d",
                       a->out != NULL ? a->out : "out/scale", (int)tree_coordinates(&sizes[i]),
                       (int)sizes[i].muscles);
        status = make_folder(folder, err);
        status = status == MHE_OK ? tree_write(&sizes[i], folder, err) : status;
        status = status == MHE_OK ? simulate(folder, err) : status;
        status = status == MHE_OK ? time_tree(a, folder, registry, host, &rows[i], err) : status;
        if (status == MHE_OK) {
            const row *r = &rows[i];
            mhi_text_add(&text, "%11d %8d %9.0f %9.3f %9.3f %9.3f %9.3f %9.3f %9.3f\n",
                         r->coordinates, r->muscles, 1 / r->frame, 1e3 * r->frame, 1e3 * r->p99,
                         1e3 * r->prepare, 1e3 * r->evaluation, 1e3 * r->rest, r->force);
        }
    }
    if (status == MHE_OK) {
        add_exponents(rows, n, &text);
        mhi_text_add(&text, "\nMedians; frames/s: one over that of a frame. Straight paths, every "
                            "third frame of 1.5 s, N = 7; prepare, evaluate, rest: as of a "
                            "config.\n");
        status = console_print(&text, err);
    }
    mhi_text_free(&text);
    return status;
}
