/* SPDX-License-Identifier: Apache-2.0 */
#include "process.h"

#include "base/text.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* `name` with respect to this program's folder. */
static mhe_status from_here(const char *name, mhi_arena *arena, const char **path, mhe_error *err) {
    char here[4096];
    const ssize_t n = readlink("/proc/self/exe", here, sizeof here - 1);
    here[n < 0 ? 0 : n] = '\0';
    char *slash = strrchr(here, '/');
    if (n < 0 || slash == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "/proc/self/exe: this program's place is not known");
    }
    *slash = '\0';
    *path = mhi_arena_format(arena, "%s/%s", here, name);
    if (*path == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return access(*path, R_OK) == 0 ? MHE_OK
                                    : mhe_fail(err, MHE_E_INPUT, "%s: %s", *path, strerror(errno));
}

mhe_status process_beside(const char *name, mhi_arena *arena, const char **path, mhe_error *err) {
    return from_here(name, arena, path, err);
}

mhe_status process_share(const char *name, mhi_arena *arena, const char **path, mhe_error *err) {
    const char *below = mhi_arena_format(arena, "../share/mhe/%s", name);
    return below == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                         : from_here(below, arena, path, err);
}

/* The child's side: stdout to `out`, where that is no -1. */
static void become(const char *const *argv, int out) {
    if (out >= 0) {
        (void)dup2(out, STDOUT_FILENO);
    }
    union {
        const char *const *lent;
        char *const *taken;
    } words = {.lent = argv}; /* execvp does not change them */
    (void)execvp(argv[0], words.taken);
    (void)fprintf(stderr, "%s: %s\n", argv[0], strerror(errno));
    _exit(127);
}

static mhe_status wait_for(pid_t pid, const char *name, mhe_error *err) {
    int how = 0;
    while (waitpid(pid, &how, 0) < 0) {
        if (errno != EINTR) {
            return mhe_fail(err, MHE_E_IO, "%s: %s", name, strerror(errno));
        }
    }
    if (WIFEXITED(how) && WEXITSTATUS(how) == 0) {
        return MHE_OK;
    }
    return WIFSIGNALED(how)
               ? mhe_fail(err, MHE_E_IO, "%s was ended by signal %d", name, WTERMSIG(how))
           : WEXITSTATUS(how) == 2
               ? mhe_fail(err, MHE_E_INPUT, "%s refused its input", name)
               : mhe_fail(err, MHE_E_IO, "%s failed, exit status %d", name, WEXITSTATUS(how));
}

mhe_status process_run(const char *const *argv, int quiet, mhe_error *err) {
    const int nothing = quiet ? open("/dev/null", O_WRONLY | O_CLOEXEC) : -1;
    (void)fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0) {
        become(argv, nothing);
    }
    if (nothing >= 0) {
        (void)close(nothing);
    }
    return pid < 0 ? mhe_fail(err, MHE_E_IO, "%s: %s", argv[0], strerror(errno))
                   : wait_for(pid, argv[0], err);
}

static void read_end(int from, mhi_text *text) {
    char part[4096];
    ssize_t n = 0;
    while ((n = read(from, part, sizeof part)) > 0 || (n < 0 && errno == EINTR)) {
        mhi_text_add(text, "%.*s", n > 0 ? (int)n : 0, part);
    }
}

mhe_status process_read(const char *const *argv, mhi_arena *arena, const char **out,
                        mhe_error *err) {
    int ends[2];
    *out = "";
    if (pipe(ends) != 0) {
        return mhe_fail(err, MHE_E_IO, "%s: %s", argv[0], strerror(errno));
    }
    (void)fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0) {
        (void)close(ends[0]);
        become(argv, ends[1]);
    }
    (void)close(ends[1]);
    mhi_text text = {0};
    if (pid > 0) {
        read_end(ends[0], &text);
    }
    (void)close(ends[0]);
    mhe_status status = pid < 0 ? mhe_fail(err, MHE_E_IO, "%s: %s", argv[0], strerror(errno))
                                : wait_for(pid, argv[0], err);
    *out = mhi_arena_text(arena, text.data == NULL ? "" : text.data);
    mhi_text_free(&text);
    return status == MHE_OK && *out == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : status;
}
