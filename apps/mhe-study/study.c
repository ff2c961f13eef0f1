/* SPDX-License-Identifier: Apache-2.0 */
#include "study.h"

#include "base/digest.h"
#include "config/options.h"
#include "config/options_value.h"
#include "io/slurp.h"
#include "noise/config.h"
#include "plugin/describe_options.h"
#include "program.h"
#include "study_private.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const mhe_option options[] = {
    MHE_OPT_PATH(study_keys, config, MHE_OPT_REQUIRED,
                 "The estimator's config, as of mhe-run; its data section is not used."),
    MHE_OPT_PATH(study_keys, reference_config, 0,
                 "Config of mhe-sim reference; its outputs are motions that 'reference' can name."),
    MHE_OPT_PATH(study_keys, program, 0,
                 "A program that makes each trial in the place of the estimator; it needs no "
                 "motions."),
    MHE_OPT_TEXTS(study_keys, reference_set, 0,
                  "'path.to.key=value' for mhe-sim reference's --set."),
    MHE_OPT_MAP(study_keys, motions, 0, "More motions: name and file, .sto with q, qdot, a and e."),
    MHE_OPT_TEXT(study_keys, reference, 0, NULL, "Motion of conditions whose factors name none."),
    MHE_OPT_INT(study_keys, trials, 1, 1, 1000000, "1", "Trials of every condition."),
    MHE_OPT_INT(study_keys, seed, 1, 0, INT32_MAX, "1",
                "Same seed, same noise in every trial, on any number of workers."),
    MHE_OPT_ENUM(study_keys, measure, "errors", "errors|timing",
                 "timing: one worker unless --workers says otherwise, so that trials do not slow "
                 "each other down."),
    MHE_OPT_REAL(study_keys, exclude_below, 0.9, 0, 1, "1",
                 "Trials with a smaller fraction of converged solves are kept but marked, and left "
                 "out of statistics."),
};
#define TRIALS_MAX 1000000 /* of a study */
#define N_OPTIONS ((int32_t)(sizeof options / sizeof options[0]))

const char *const study_sections[] = {"factors", "grids", "set", "noise", "keep_forces", "report"};
const int32_t study_n_sections = (int32_t)(sizeof study_sections / sizeof study_sections[0]);

mhe_status study_no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

void study_describe(mhi_text *out) {
    mhi_options_text(options, N_OPTIONS, out);
    mhi_text_add(
        out,
        "  factors        {name: {key: path.to.key, values: {label: value}}}: 'values' may be a\n"
        "                 list; 'keys' with lists of values sets several at once; a key is\n"
        "                 'reference' (a motion), 'noise....' (mhe-sim noise --help) or one of "
        "the\n"
        "                 estimator's config; without a key a factor only labels; without values\n"
        "                 the grids give them\n"
        "  grids          [{factor: labels or values, set: {path.to.key: value}, trials: n}]: all\n"
        "                 combinations of each entry; a factor that is not named takes all levels\n"
        "  set            {path.to.key: value} for all conditions\n"
        "  noise          as in mhe-sim noise, for all conditions\n"
        "  keep_forces    [{factor: labels}]: conditions whose muscle forces are kept\n"
        "  report         tables and figures that mhe-study report makes\n");
    program_describe(out);
}

/* ---- reading ---- */

static mhe_status name_study(study *s, const char *path, mhe_error *err) {
    char here[4096];
    const char *slash = strrchr(path, '/');
    const char *base = slash == NULL ? path : slash + 1;
    const char *dot = strrchr(base, '.');
    const int length = dot == NULL || dot == base ? (int)strlen(base) : (int)(dot - base);
    if (getcwd(here, sizeof here) == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "the working directory is not known: %s",
                        strerror(errno));
    }
    const int folder = slash == NULL ? 0 : (int)(slash - path);
    s->path = mhi_arena_text(&s->arena, path);
    s->name = mhi_arena_format(&s->arena, "%.*s", length, base);
    s->dir = path[0] == '/' ? mhi_arena_format(&s->arena, "%.*s", folder, path)
             : folder == 0  ? mhi_arena_text(&s->arena, here)
                            : mhi_arena_format(&s->arena, "%s/%.*s", here, folder, path);
    return s->path == NULL || s->name == NULL || s->dir == NULL ? study_no_memory(err) : MHE_OK;
}

/* The file's tree with `set` on top of what the command line sets. */
static mhe_status parse(const study *s, const assignment *set, int32_t n_set, mhi_tree **tree,
                        mhe_error *err) {
    mhe_status status = mhi_tree_parse(s->path, s->text, strlen(s->text), tree, err);
    for (int32_t i = 0; i < s->n_override && status == MHE_OK; i++) {
        status = mhi_tree_set(*tree, s->override[i], err);
    }
    for (int32_t i = 0; i < n_set && status == MHE_OK; i++) {
        status = mhi_tree_set(*tree, set[i].text, err);
    }
    return status;
}

static mhe_status read_text(study *s, mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    mhe_status status = mhi_slurp(s->path, &text, &length, err);
    if (status == MHE_OK && strlen(text) != length) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: holds a NUL byte: not YAML", s->path);
    }
    if (status == MHE_OK) {
        s->text = mhi_arena_text(&s->arena, text);
        status = s->text == NULL ? study_no_memory(err) : MHE_OK;
    }
    free(text);
    return status;
}

static int32_t duplicate(const study *s, int32_t i) {
    const size_t size = sizeof(int32_t) * (size_t)s->n_factors;
    for (int32_t k = 0; k < i; k++) {
        if (memcmp(s->conditions[k].level, s->conditions[i].level, size) == 0) {
            return k;
        }
    }
    return -1;
}

static mhe_status check_conditions(study *s, mhe_error *err) {
    int64_t trials = 0;
    for (int32_t i = 0; i < s->n_conditions; i++) {
        const condition *c = &s->conditions[i];
        if (duplicate(s, i) >= 0) {
            mhi_text text = {0};
            study_condition_text(s, c, &text);
            mhe_status status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, c->node,
                                            "grids: the condition %s is there twice", text.data);
            mhi_text_free(&text);
            return status;
        }
        trials += c->trials;
    }
    s->n_trials = (int32_t)trials;
    return trials > TRIALS_MAX ? mhe_fail(err, MHE_E_CONFIG, "%s: %lld trials are more than %d",
                                          s->path, (long long)trials, TRIALS_MAX)
                               : MHE_OK;
}

/* What would be found after the last trial, or the first. */
static mhe_status check_ends(const study *s, mhe_error *err) {
    const mhi_node *root = mhi_tree_root(s->tree), *report = mhi_node_find(root, "report");
    if (report != NULL && report->kind != MHI_MAPPING && !mhi_node_is_null(report)) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, report,
                           "report: a mapping {boxes: [...], anova: [...], pairs: [...], ...}");
    }
    if (s->keys.program != NULL && access(s->keys.program, R_OK) != 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, mhi_node_find(root, "program"),
                           "program: %s: %s", s->keys.program, strerror(errno));
    }
    return MHE_OK;
}

mhe_status study_read(const char *path, const char *const *set, int32_t n_set, study *s,
                      mhe_error *err) {
    *s = (study){.override = set, .n_override = n_set};
    mhe_status status = name_study(s, path, err);
    status = status == MHE_OK ? read_text(s, err) : status;
    status = status == MHE_OK ? parse(s, NULL, 0, &s->tree, err) : status;
    if (status == MHE_OK && mhi_tree_root(s->tree)->kind != MHI_MAPPING) {
        status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, mhi_tree_root(s->tree),
                             "a study is a mapping (config, factors, trials, ...)");
    }
    if (status == MHE_OK) {
        status =
            mhi_options_fill(options, N_OPTIONS, s->tree, mhi_tree_root(s->tree), study_sections,
                             study_n_sections, NULL, s->dir, &s->arena, &s->keys, err);
    }
    status = status == MHE_OK ? study_read_factors(s, err) : status;
    status = status == MHE_OK ? study_read_grids(s, err) : status;
    status = status == MHE_OK ? check_ends(s, err) : status;
    return status == MHE_OK ? check_conditions(s, err) : status;
}

mhe_status study_is_harmless(const study *s, mhe_error *err) {
    const mhi_node *program = mhi_node_find(mhi_tree_root(s->tree), "program");
    return s->keys.program == NULL
               ? MHE_OK
               : mhi_fail_at(err, MHE_E_CONFIG, s->tree, program,
                             "program: %s would run with your rights; --trust says that it may",
                             s->keys.program);
}

void study_free(study *s) {
    for (int32_t i = 0; i < s->n_conditions; i++) {
        mhi_run_free(s->conditions[i].run);
        mhi_tree_free(s->conditions[i].noise_tree);
    }
    for (int32_t i = 0; i < s->n_factors; i++) {
        free(s->factors[i].levels);
    }
    mhi_tree_free(s->tree);
    mhi_arena_free(&s->arena);
    *s = (study){0};
}

/* ---- conditions with their configs ---- */

static int is_noise(const char *text) {
    return strncmp(text, "noise", 5) == 0 && (text[5] == '.' || text[5] == '=');
}

static int is_reference(const char *text) {
    return strncmp(text, "reference=", 10) == 0;
}

static mhe_status read_noise(study *s, const assignment *set, int32_t n_set, condition *c,
                             mhe_error *err) {
    mhi_tree_free(c->noise_tree);
    c->noise_tree = NULL;
    mhe_status status = parse(s, set, n_set, &c->noise_tree, err);
    return status == MHE_OK ? mhi_noise_read(c->noise_tree, &s->arena, &c->noise, err) : status;
}

/* With the first `n` of the condition's assignments. */
static mhe_status try_resolve(study *s, condition *c, int32_t n, mhi_registry *registry,
                              mhe_error *err) {
    const char **of_config = MHI_TAKE(&s->arena, const char *, n);
    assignment *of_noise = MHI_TAKE(&s->arena, assignment, n);
    int32_t n_config = 0, n_noise = 0;
    if (of_config == NULL || of_noise == NULL) {
        return study_no_memory(err);
    }
    c->reference = s->keys.reference;
    for (int32_t i = 0; i < n; i++) {
        if (is_noise(c->set[i].text)) {
            of_noise[n_noise++] = c->set[i];
        } else if (is_reference(c->set[i].text)) {
            c->reference = strchr(c->set[i].text, '=') + 1;
        } else {
            of_config[n_config++] = c->set[i].text;
        }
    }
    mhi_run_free(c->run);
    c->run = NULL;
    mhe_status status = read_noise(s, of_noise, n_noise, c, err);
    return status == MHE_OK
               ? mhi_run_read(s->keys.config, of_config, n_config, registry, &c->run, err)
               : status;
}

/* Which assignment is refused: the first one that, put on top of those before it, fails. */
static mhe_status blame(study *s, condition *c, mhi_registry *registry, mhe_status status,
                        mhe_error *err) {
    mhe_error why = *err;
    for (int32_t n = 0; n <= c->n_set; n++) {
        mhe_error first = {0};
        if (try_resolve(s, c, n, registry, &first) == MHE_OK) {
            continue;
        }
        if (n == 0) { /* the config itself, or the study's section `noise` */
            *err = first;
            return status;
        }
        const assignment *a = &c->set[n - 1];
        static const char lead[] = "--set: ";
        const char *text = strstr(first.text, lead);
        text = text != NULL ? text + sizeof lead - 1 : first.text;
        return mhi_fail_at(err, status, s->tree, a->node, "%s '%s': %s", a->factor, a->label, text);
    }
    *err = why;
    return status;
}

mhe_status study_resolve(study *s, mhi_registry *registry, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->n_conditions && status == MHE_OK; i++) {
        condition *c = &s->conditions[i];
        status = try_resolve(s, c, c->n_set, registry, err);
        if (status != MHE_OK) {
            return blame(s, c, registry, status, err);
        }
        if (s->keys.program == NULL && (c->reference == NULL || *c->reference == '\0')) {
            status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, mhi_tree_root(s->tree),
                                 "no motion is given: a key 'reference', or a factor with it");
        }
    }
    return status;
}

/* ---- what a condition and a trial are called ---- */

const char *study_label(const study *s, const condition *c, int32_t factor_number) {
    return s->factors[factor_number].levels[c->level[factor_number]].label;
}

void study_condition_text(const study *s, const condition *c, mhi_text *out) {
    for (int32_t i = 0; i < s->n_factors; i++) {
        mhi_text_add(out, "%s%s=%s", i == 0 ? "" : " ", s->factors[i].name, study_label(s, c, i));
    }
}

int32_t study_seed(const study *s, const condition *c, int32_t trial) {
    mhi_text text = {0};
    mhi_text_add(&text, "%d %d ", (int)s->keys.seed, (int)trial);
    study_condition_text(s, c, &text);
    const uint64_t hash = text.failed ? 0 : mhi_digest(text.data, text.length);
    mhi_text_free(&text);
    return (int32_t)((hash ^ (hash >> 31)) & INT32_MAX);
}

mhe_status study_order(study *s, task **tasks, mhe_error *err) {
    task *list = *tasks = MHI_TAKE(&s->arena, task, s->n_trials);
    if (list == NULL) {
        return study_no_memory(err);
    }
    int32_t n = 0;
    for (int32_t trial = 0; n < s->n_trials; trial++) {
        for (int32_t i = 0; i < s->n_conditions; i++) {
            if (trial < s->conditions[i].trials) {
                list[n++] = (task){i, trial};
            }
        }
    }
    return MHE_OK;
}
