/* SPDX-License-Identifier: Apache-2.0 */
/* figure.c: the script's file, and the run of gnuplot. */
#include "figure.h"

#include <errno.h>
#include <fcntl.h>
#include <mhe/outbox.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

static mhe_status write_script(const figure *f, mhe_outbox *outbox, mhe_error *err) {
    mhi_text script = {0}, file = {0};
    figure_script(f, &script);
    mhi_text_add(&file, "%s.gp", f->name);
    mhe_status status = script.failed || file.failed
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhe_outbox_text(outbox, file.data, script.data, err);
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhi_text_free(&script);
    mhi_text_free(&file);
    return status;
}

/* Runs gnuplot without a shell. It draws into its standard output, which is our file: gnuplot
 * itself opens no name in the folder for writing. */
static mhe_status run_gnuplot(const figure *f, const char *dir, int picture, mhe_error *err) {
    mhi_text command = {0};
    mhi_text_add(&command, FIGURE_DIRECT " = 1; cd '");
    for (const char *c = dir; *c != '\0'; c++) {
        mhi_text_add(&command, *c == '\'' ? "''" : "%c", *c);
    }
    mhi_text_add(&command, "'; load '%s.gp'", f->name);
    posix_spawn_file_actions_t actions;
    if (command.failed || posix_spawn_file_actions_init(&actions) != 0) {
        mhi_text_free(&command);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    (void)posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    (void)posix_spawn_file_actions_adddup2(&actions, picture, STDOUT_FILENO);
    (void)posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    char program[] = "gnuplot", defaults[] = "-d", execute[] = "-e";
    char *arguments[] = {program, defaults, execute, command.data, NULL};
    pid_t child = -1;
    int reason = posix_spawnp(&child, program, &actions, NULL, arguments, environ);
    (void)posix_spawn_file_actions_destroy(&actions);
    mhi_text_free(&command);
    if (reason != 0) {
        return mhe_fail(err, MHE_E_UNSUPPORTED,
                        "no picture: gnuplot cannot be started (%s); install gnuplot and run "
                        "'gnuplot %s.gp' in %s",
                        strerror(reason), f->name, dir);
    }
    int result = 0;
    while (waitpid(child, &result, 0) < 0 && errno == EINTR) {
    }
    if (!WIFEXITED(result) || WEXITSTATUS(result) != 0) {
        return mhe_fail(err, MHE_E_IO,
                        "no picture: gnuplot failed; run 'gnuplot %s.gp' in %s to see why", f->name,
                        dir);
    }
    return MHE_OK;
}

/* An older picture beside the new script would be taken for its own. */
static void remove_picture(const char *dir, const char *name) {
    mhi_text path = {0};
    mhi_text_add(&path, "%s/%s", dir, name);
    if (!path.failed) {
        (void)unlink(path.data);
    }
    mhi_text_free(&path);
}

mhe_status figure_draw(const figure *f, const char *dir, mhe_error *err) {
    char name[64];
    mhe_outbox *outbox = NULL;
    FILE *picture = NULL;
    (void)snprintf(name, sizeof name, "%s.svg", f->name);
    mhe_status status = mhe_outbox_open(dir, &outbox, err);
    if (status == MHE_OK) {
        status = write_script(f, outbox, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_stream(outbox, name, &picture, err);
    }
    if (status == MHE_OK) {
        status = run_gnuplot(f, dir, fileno(picture), err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    if (status != MHE_OK) {
        remove_picture(dir, name);
    }
    mhe_outbox_close(outbox);
    return status;
}
