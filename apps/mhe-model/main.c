/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-model: what is in a model file, and what the model says at given poses. */
#include "console.h"

#include <mhe/inspect.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "usage: mhe-model info MODEL [--json]\n"
    "       mhe-model evaluate MODEL --poses FILE.json [--out FILE.json] [--paths exact|fitted]\n"
    "\n"
    "info      coordinates, bodies and masses, muscles, wraps, couplers, other forces, markers of\n"
    "          a .osim or .bioMod file; what is not supported, left out or repaired, with its "
    "line\n"
    "evaluate  positions, lengths, moment arms, mass matrix, inverse dynamics, muscle forces and\n"
    "          joint reactions at the poses of FILE.json (its form: mhe/inspect.h), as JSON\n"
    "\n"
    "Exit status: 0 done; 2 the command line or a file is wrong; 1 anything else.\n";

typedef struct words {
    const char *model, *poses, *out;
    int32_t json, paths;
} words;

static mhe_status read_paths(const char *word, int32_t *paths, mhe_error *err) {
    if (strcmp(word, "exact") == 0) {
        *paths = MHE_PATHS_EXACT;
    } else if (strcmp(word, "fitted") == 0) {
        *paths = MHE_PATHS_FITTED;
    } else {
        return mhe_fail(err, MHE_E_ARGUMENT, "--paths '%s': exact or fitted", word);
    }
    return MHE_OK;
}

static mhe_status read_words(int argc, char **argv, int32_t evaluate, words *w, mhe_error *err) {
    static const char *const of_info[] = {"--json"};
    static const char *const of_evaluate[] = {"--poses", "--out", "--paths"};
    mhe_status status = MHE_OK;
    for (int i = 2; i < argc && status == MHE_OK; i++) {
        const char *value = NULL;
        if (!evaluate && strcmp(argv[i], "--json") == 0) {
            w->json = 1;
        } else if (evaluate && (strcmp(argv[i], "--poses") == 0 || strcmp(argv[i], "--out") == 0)) {
            const char **into = argv[i][2] == 'p' ? &w->poses : &w->out;
            status = console_value(argc, argv, &i, into, err);
        } else if (evaluate && strcmp(argv[i], "--paths") == 0) {
            status = console_value(argc, argv, &i, &value, err);
            status = status == MHE_OK ? read_paths(value, &w->paths, err) : status;
        } else {
            status = console_config(argv[i], evaluate ? of_evaluate : of_info, evaluate ? 3 : 1,
                                    &w->model, err);
        }
    }
    if (status == MHE_OK && w->model == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "which model? mhe-model --help");
    }
    if (status == MHE_OK && evaluate && w->poses == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "which poses? --poses FILE.json");
    }
    return status;
}

/* The whole file; *text is to be freed. */
static mhe_status slurp(const char *path, char **text, size_t *length, mhe_error *err) {
    FILE *stream = fopen(path, "rb");
    size_t room = 1 << 16, n = 0, got;
    *text = malloc(room);
    if (stream == NULL || *text == NULL) {
        if (stream != NULL) {
            (void)fclose(stream);
        }
        return mhe_fail(err, MHE_E_INPUT, "%s: cannot be read", path);
    }
    while ((got = fread(*text + n, 1, room - n, stream)) > 0) {
        n += got;
        if (n == room) {
            char *more = realloc(*text, 2 * room);
            if (more == NULL) {
                break;
            }
            *text = more;
            room *= 2;
        }
    }
    const int bad = ferror(stream) || n == room;
    (void)fclose(stream);
    *length = n;
    return bad ? mhe_fail(err, MHE_E_INPUT, "%s: cannot be read", path) : MHE_OK;
}

static mhe_status give(const char *path, const char *text, mhe_error *err) {
    FILE *stream = path != NULL ? fopen(path, "wb") : stdout;
    if (stream == NULL) {
        return mhe_fail(err, MHE_E_IO, "%s: cannot be written", path);
    }
    int bad = fputs(text, stream) < 0;
    bad |= path != NULL ? fclose(stream) != 0 : fflush(stream) != 0;
    return bad ? mhe_fail(err, MHE_E_IO, "%s: cannot be written", path != NULL ? path : "stdout")
               : MHE_OK;
}

static mhe_status evaluate(const mhe_host *host, const words *w, char **answer, mhe_error *err) {
    char *poses = NULL;
    size_t length = 0;
    mhe_status status = slurp(w->poses, &poses, &length, err);
    if (status == MHE_OK) {
        status = mhe_model_evaluate(host, w->model, w->poses, poses, length, w->paths, answer, err);
    }
    free(poses);
    return status;
}

int main(int argc, char **argv) {
    static const char *const commands[] = {"info", "evaluate"};
    const mhe_host host = console_host("mhe-model");
    words w = {0};
    mhe_error err = {0};
    char *answer = NULL;
    int32_t chosen = -1;
    mhe_status status =
        console_command("mhe-model", help, commands, 2, argc > 1 ? argv[1] : NULL, &chosen, &err);
    if (status == MHE_OK && chosen >= 0) {
        status = read_words(argc, argv, chosen, &w, &err);
        if (status == MHE_OK) {
            status = chosen == 0
                         ? mhe_model_info(&host, w.model,
                                          w.json ? MHE_FORMAT_JSON : MHE_FORMAT_TEXT, &answer, &err)
                         : evaluate(&host, &w, &answer, &err);
        }
        if (status == MHE_OK) {
            status = give(w.out, answer, &err);
        }
    }
    mhe_free(answer);
    return console_end("mhe-model", status, &err);
}
