/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-model: what is in a model file, and what the model says at given poses. */
#include "console.h"
#include "words.h"

#include <mhe/inspect.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct arguments {
    const char *model, *poses, *out;
    int32_t mode, json, paths, steps;
    words_list others;
} arguments;

static mhe_status read_paths(const char *word, const char *value, void *target, mhe_error *err) {
    int32_t *paths = target;
    if (strcmp(value, "exact") == 0) {
        *paths = MHE_PATHS_EXACT;
    } else if (strcmp(value, "fitted") == 0) {
        *paths = MHE_PATHS_FITTED;
    } else {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s '%s': exact or fitted", word, value);
    }
    return MHE_OK;
}

static const words_command commands[] = {
    {.name = "info",
     .operand = "MODEL",
     .what = "model file",
     .help = "coordinates, bodies and masses, muscles, wraps, couplers, other forces, markers of a "
             ".osim or .bioMod file; what is not supported, left out or repaired, with its line",
     .most = 1,
     .missing = "which model? mhe-model --help"},
    {.name = "evaluate",
     .operand = "MODEL",
     .what = "model file",
     .help = "positions, lengths, moment arms, mass matrix, inverse dynamics, muscle forces and "
             "joint reactions at the poses of FILE.json (its form: mhe/inspect.h), as JSON",
     .most = 1,
     .missing = "which model? mhe-model --help"},
    {.name = "scale",
     .operand = "SETUP.xml",
     .what = "setup file",
     .help = "the model of a person out of a generic one, as a Scale setup of OpenSim says: bodies "
             "by marker distances of a static trial, muscles by their paths, then the markers' "
             "places",
     .most = 1,
     .missing = "which setup? mhe-model --help"},
    {.name = "sweep",
     .operand = "MODEL",
     .what = "model file",
     .help = "where lengths of paths jump by more than 1 mm while one coordinate after the other "
             "goes through its range: at conditional points, and where a path changes its way "
             "around obstacles",
     .most = 1,
     .missing = "which model? mhe-model --help"}};
#define INFO 1u
#define EVALUATE 2u
#define SCALE 4u
#define SWEEP 8u
#define AT(field) offsetof(arguments, field)

static const words_option options[] = {{.name = "--json",
                                        .help = "info or sweep as JSON",
                                        .commands = INFO | SWEEP,
                                        .kind = WORDS_FLAG,
                                        .at = AT(json),
                                        .low = 1},
                                       {.name = "--poses",
                                        .value = "FILE.json",
                                        .help = "where to evaluate",
                                        .commands = EVALUATE,
                                        .kind = WORDS_TEXT,
                                        .at = AT(poses)},
                                       {.name = "--out",
                                        .value = "FILE",
                                        .help = "the answer, .json, stdout unless given; the "
                                                "scaled model, .osim",
                                        .commands = EVALUATE | SCALE,
                                        .kind = WORDS_TEXT,
                                        .at = AT(out)},
                                       {.name = "--paths",
                                        .value = "exact|fitted",
                                        .help = "how lengths of paths are computed",
                                        .commands = EVALUATE,
                                        .kind = WORDS_OTHER,
                                        .at = AT(paths),
                                        .take = read_paths},
                                       {.name = "--steps",
                                        .value = "N",
                                        .help = "of each coordinate, 400 unless given",
                                        .commands = SWEEP,
                                        .kind = WORDS_INT,
                                        .at = AT(steps),
                                        .low = 1,
                                        .high = 100000}};

static const words_program program = {
    .name = "mhe-model",
    .summary = "What is in a model file, and what the model says at given poses.",
    .usage = "  mhe-model info MODEL [--json]\n"
             "  mhe-model evaluate MODEL --poses FILE.json [--out FILE.json] [--paths "
             "exact|fitted]\n"
             "  mhe-model scale SETUP.xml --out MODEL.osim\n"
             "  mhe-model sweep MODEL [--steps N] [--json]\n"
             "  mhe-model --version | --help\n",
    .notes = "Exit status: 0 done; 2 the command line or a file is wrong; 1 anything else.\n",
    .commands = commands,
    .n_commands = 4,
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(model),
    .others = AT(others)};

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

static mhe_status evaluate(const mhe_host *host, const arguments *w, char **answer,
                           mhe_error *err) {
    char *poses = NULL;
    size_t length = 0;
    mhe_status status = slurp(w->poses, &poses, &length, err);
    if (status == MHE_OK) {
        status = mhe_model_evaluate(host, w->model, w->poses, poses, length, w->paths, answer, err);
    }
    free(poses);
    return status;
}

static mhe_status answer_to(const mhe_host *host, int32_t command, const arguments *w,
                            char **answer, mhe_error *err) {
    if (command == 0) {
        return mhe_model_info(host, w->model, w->json ? MHE_FORMAT_JSON : MHE_FORMAT_TEXT, answer,
                              err);
    }
    if (command == 3) {
        return mhe_model_sweep(host, w->model, w->steps > 0 ? w->steps : 400,
                               w->json ? MHE_FORMAT_JSON : MHE_FORMAT_TEXT, answer, err);
    }
    if (command == 2) {
        return w->out == NULL ? mhe_fail(err, MHE_E_ARGUMENT, "where to? --out MODEL.osim")
                              : mhe_model_scale(host, w->model, w->out, answer, err);
    }
    if (w->poses == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "which poses? --poses FILE.json");
    }
    return evaluate(host, w, answer, err);
}

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-model");
    arguments w = {0};
    mhe_error err = {0};
    char *answer = NULL;
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&program, argc, argv, &w, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_HELP) {
        words_help(&program);
    } else if (status == MHE_OK && outcome == WORDS_RUN) {
        status = answer_to(&host, command, &w, &answer, &err);
        if (status == MHE_OK) {
            status = give(command == 2 ? NULL : w.out, answer, &err);
        }
    }
    mhe_free(answer);
    words_free(&program, &w);
    return console_end("mhe-model", status, &err);
}
