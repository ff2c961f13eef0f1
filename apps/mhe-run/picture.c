/* SPDX-License-Identifier: Apache-2.0 */
/* What is shown, and the run of gnuplot; picture_script.c writes the script. */
#include "picture.h"

#include "io/sink.h"
#include "picture_script.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

#define DEGREES (180 / 3.14159265358979323846)

static void add_panel(picture *p, int32_t column, const char *label, int32_t of_forces) {
    p->panels[p->n_panels++] = (picture_panel){
        .column = column, .name = label, .reference_column = -1, .of_forces = of_forces};
}

/* The coordinates: columns q_<name> of the estimates, as many as there is room for. */
static void choose_angles(picture *p) {
    const mhi_table *t = p->estimates;
    for (int32_t i = 0; i < t->n_labels && p->n_panels < PICTURE_ANGLES_MAX; i++) {
        if (strncmp(t->labels[i], "q_", 2) != 0) {
            continue;
        }
        add_panel(p, i, t->labels[i] + 2, 0);
        if (p->reference != NULL) {
            picture_panel *panel = &p->panels[p->n_panels - 1];
            char numbered[16];
            (void)snprintf(numbered, sizeof numbered, "q%d", p->n_panels - 1);
            int32_t named = mhi_table_find(p->reference, t->labels[i]);
            panel->reference_column = named >= 0 ? named : mhi_table_find(p->reference, numbered);
            panel->reference_scale = p->reference->in_degrees ? 1 : DEGREES;
        }
    }
    p->n_angles = p->n_panels;
}

static double largest(const mhi_table *t, int32_t column) {
    double most = 0;
    for (int32_t k = 0; k < t->n_rows; k++) {
        double value = t->values[(size_t)k * (size_t)t->n_columns + (size_t)column];
        most = value > most ? value : most;
    }
    return most;
}

/* The muscles with the largest forces, in the order of the model. */
static void choose_forces(picture *p) {
    const mhi_table *t = p->forces;
    for (int32_t i = 0; i < t->n_labels; i++) {
        int32_t stronger = 0;
        double force = largest(t, i);
        for (int32_t j = 0; j < t->n_labels; j++) {
            double other = largest(t, j);
            stronger += other > force || (other == force && j < i);
        }
        if (stronger >= PICTURE_FORCES_MAX) {
            continue;
        }
        add_panel(p, i, t->labels[i], 1);
        if (p->reference != NULL) {
            char label[256];
            (void)snprintf(label, sizeof label, "F_%s", t->labels[i]);
            p->panels[p->n_panels - 1].reference_column = mhi_table_find(p->reference, label);
            p->panels[p->n_panels - 1].reference_scale = 1;
        }
    }
}

static mhe_status read_in(const char *dir, const char *name, mhi_table **table, mhe_error *err) {
    char path[4096];
    int n = snprintf(path, sizeof path, "%s/%s", dir, name);
    if (n < 0 || (size_t)n >= sizeof path) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s: the path is too long", dir);
    }
    return mhi_sto_read(path, table, err);
}

static mhe_status write_script(const picture *p, const char *dir, mhe_error *err) {
    mhi_text script = {0};
    mhi_outbox *outbox = NULL;
    picture_script(p, &script);
    mhe_status status = script.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                      : mhi_outbox_open(dir, &outbox, err);
    if (status == MHE_OK) {
        status = mhi_outbox_text(outbox, "estimates.gp", script.data, err);
    }
    if (status == MHE_OK) {
        status = mhi_outbox_commit(outbox, err);
    }
    mhi_outbox_close(outbox);
    mhi_text_free(&script);
    return status;
}

/* Runs gnuplot without a shell, its streams closed. */
static mhe_status run_gnuplot(const char *dir, mhe_error *err) {
    mhi_text command = {0};
    mhi_text_add(&command, "cd '");
    for (const char *c = dir; *c != '\0'; c++) {
        mhi_text_add(&command, *c == '\'' ? "''" : "%c", *c);
    }
    mhi_text_add(&command, "'; load 'estimates.gp'");
    posix_spawn_file_actions_t actions;
    if (command.failed || posix_spawn_file_actions_init(&actions) != 0) {
        mhi_text_free(&command);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int stream = 0; stream < 3; stream++) {
        (void)posix_spawn_file_actions_addopen(&actions, stream, "/dev/null",
                                               stream == 0 ? O_RDONLY : O_WRONLY, 0);
    }
    char program[] = "gnuplot", defaults[] = "-d", execute[] = "-e";
    char *arguments[] = {program, defaults, execute, command.data, NULL};
    pid_t child = -1;
    int reason = posix_spawnp(&child, program, &actions, NULL, arguments, environ);
    (void)posix_spawn_file_actions_destroy(&actions);
    mhi_text_free(&command);
    if (reason != 0) {
        return mhe_fail(err, MHE_E_UNSUPPORTED,
                        "no picture: gnuplot cannot be started (%s); install gnuplot and run "
                        "'gnuplot estimates.gp' in %s",
                        strerror(reason), dir);
    }
    int result = 0;
    while (waitpid(child, &result, 0) < 0 && errno == EINTR) {
    }
    if (!WIFEXITED(result) || WEXITSTATUS(result) != 0) {
        return mhe_fail(err, MHE_E_IO,
                        "no picture: gnuplot failed; run 'gnuplot estimates.gp' in %s to see why",
                        dir);
    }
    return MHE_OK;
}

mhe_status picture_estimates(const char *dir, const char *reference, mhe_error *err) {
    mhi_table *estimates = NULL, *forces = NULL, *truth = NULL;
    mhe_status status = read_in(dir, "estimates.sto", &estimates, err);
    if (status == MHE_OK) {
        status = read_in(dir, "forces.sto", &forces, err);
    }
    if (status == MHE_OK && reference != NULL) {
        status = mhi_sto_read(reference, &truth, err);
    }
    if (status == MHE_OK) {
        picture p = {.estimates = estimates, .forces = forces, .reference = truth};
        choose_angles(&p);
        choose_forces(&p);
        status = write_script(&p, dir, err);
    }
    if (status == MHE_OK) {
        status = run_gnuplot(dir, err);
    }
    mhi_table_free(estimates);
    mhi_table_free(forces);
    mhi_table_free(truth);
    return status;
}
