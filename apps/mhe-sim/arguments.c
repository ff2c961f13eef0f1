/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "console.h"

#include <stdlib.h>
#include <string.h>

#define WORDS_MAX 6

/* Words of a command that takes this, into words [WORDS_MAX]. */
static int32_t choose_words(int32_t takes, const char **words) {
    static const struct {
        const char *word;
        int32_t needs;
    } all[WORDS_MAX] = {{"--out", 0},
                        {"--set", 0},
                        {"--help", 0},
                        {"--input", ARGUMENTS_INPUT},
                        {"--rate", ARGUMENTS_INPUT},
                        {"--no-cache", ARGUMENTS_CACHE}};
    int32_t n = 0;
    for (int32_t i = 0; i < WORDS_MAX; i++) {
        if ((all[i].needs & ~takes) == 0) {
            words[n++] = all[i].word;
        }
    }
    return n;
}

static mhe_status read_rate(const char *text, double *rate, mhe_error *err) {
    char *end = NULL;
    *rate = strtod(text, &end);
    if (end == text || *end != '\0' || !(*rate > 0 && *rate <= 1e5)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "--rate '%s': a number of Hz above 0 is needed", text);
    }
    return MHE_OK;
}

static mhe_status take_option(const char *word, const char *value, int32_t takes, arguments *a,
                              mhe_error *err) {
    const char *words[WORDS_MAX];
    const int32_t n_words = choose_words(takes, words);
    int32_t known = 0;
    for (int32_t i = 0; i < n_words; i++) {
        known = known || strcmp(word, words[i]) == 0;
    }
    if (!known) {
        return console_config(word, words, n_words, &a->config, err);
    }
    if (strcmp(word, "--no-cache") == 0) {
        a->no_cache = 1;
        return MHE_OK;
    }
    if (value == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s needs a value", word);
    }
    if (strcmp(word, "--rate") == 0) {
        return read_rate(value, &a->rate, err);
    }
    if (strcmp(word, "--set") == 0) {
        a->set[a->n_set++] = value;
    } else {
        *(strcmp(word, "--input") == 0 ? &a->input : &a->out) = value;
    }
    return MHE_OK;
}

mhe_status arguments_parse(int argc, char **argv, int32_t takes, arguments *a, mhe_error *err) {
    *a = (arguments){.rate = 100, .set = calloc((size_t)argc, sizeof(char *))};
    if (a->set == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int i = 2; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            a->help = 1;
            return MHE_OK;
        }
    }
    mhe_status status = MHE_OK;
    for (int i = 2; i < argc && status == MHE_OK; i++) {
        if (argv[i][0] == '-') {
            status = take_option(argv[i], i + 1 < argc ? argv[i + 1] : NULL, takes, a, err);
            i += strcmp(argv[i], "--no-cache") != 0; /* the only one without a value */
        } else {
            status = console_config(argv[i], NULL, 0, &a->config, err);
        }
    }
    if (status == MHE_OK &&
        (a->config == NULL || ((takes & ARGUMENTS_INPUT) && a->input == NULL))) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "a config file%s needed; 'mhe-sim --help'",
                          takes & ARGUMENTS_INPUT ? " and --input are" : " is");
    }
    return status;
}

void arguments_free(arguments *a) {
    free(a->set);
}

mhe_status arguments_folder(const arguments *a, const char *name, const char *suffix, char *out,
                            size_t size, mhe_error *err) {
    const int n = a->out != NULL ? snprintf(out, size, "%s", a->out)
                                 : snprintf(out, size, "out/%s%s", name, suffix);
    return n >= 0 && (size_t)n < size
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "the path of the output folder is too long");
}
