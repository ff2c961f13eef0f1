/* SPDX-License-Identifier: Apache-2.0 */
#include "noise/config.h"

#include "config/options.h"
#include "plugin/describe_options.h"

#include <string.h>

/* rate, latency and clock_error of a section with a mhi_clock. */
#define CLOCK_OPTION(T, field, dflt, low, high, unit_, help_)                                \
    {                                                                                        \
        .key = #field, .help = help_, .unit = unit_, .real_default = dflt, .min = low,       \
        .max = high, .type = MHE_TYPE_REAL, .offset = MHE_OPT_OFFSET(T, clock.field, double) \
    }
#define CLOCK_OPTIONS(T, rate_)                                                                    \
    CLOCK_OPTION(T, rate, rate_, 0, 1e5, "Hz", "Samples a second; 0: the reference's own times."), \
        CLOCK_OPTION(T, latency, 0, -10, 10, "s",                                                  \
                     "A sample shows what was this long before its time."),                        \
        CLOCK_OPTION(T, clock_error, 0, -0.1, 0.1, "1",                                            \
                     "Fraction by which the instrument's clock is slow.")

static const mhe_option top_options[] = {
    MHE_OPT_PATH(mhi_noise_config, reference, MHE_OPT_REQUIRED,
                 "The true motion: q_*, qdot_* and e_* as mhe-sim writes them, .sto."),
};

static const mhe_option noise_options[] = {
    MHE_OPT_INT(mhi_noise, seed, 1, 0, INT32_MAX, "1",
                "Same seed, same noise; each kind of noise has numbers of its own."),
};

static const mhe_option marker_options[] = {
    MHE_OPT_REAL(mhi_marker_noise, sd, 0, 0, 0.5, "m",
                 "Spread of each marker's constant displacement in its segment, per axis."),
    MHE_OPT_REAL(mhi_marker_noise, white_sd, 0, 0, 0.5, "m",
                 "Spread of white noise per marker, sample and axis."),
    MHE_OPT_REAL(mhi_marker_noise, drift_sd, 0, 0, 0.5, "m",
                 "Spread of a slow wander per marker and axis."),
    MHE_OPT_REAL(mhi_marker_noise, drift_time, 1, 1e-3, 1e6, "s",
                 "Correlation time of the wander."),
    MHE_OPT_MAP(mhi_marker_noise, gaps, 0, "Marker: when it is not seen, '1..1.5, 2..2.2' in s."),
    MHE_OPT_MAP(mhi_marker_noise, segment_gaps, 0,
                "Segment: when all its markers are not seen, '1..1.5' in s."),
    CLOCK_OPTIONS(mhi_marker_noise, 0),
};

static const mhe_option emg_options[] = {
    MHE_OPT_REAL(mhi_emg_noise, level, 0, 0, 100, "1",
                 "Noise on the low harmonics of each muscle; the paper's levels are 0, 1, 1.5, 2."),
    MHE_OPT_REAL(mhi_emg_noise, gain_sd, 0, 0, 10, "1",
                 "Spread of each muscle's constant factor around 1."),
    MHE_OPT_MAP(mhi_emg_noise, crosstalk, 0,
                "Muscle: what its electrode reads of others, 'BRD 0.2, BicepsLong 0.1'."),
    MHE_OPT_MAP(mhi_emg_noise, failures, 0,
                "Muscle: when its electrode is off, '1..1.5, 2..2.2' in s."),
    MHE_OPT_ENUM(mhi_emg_noise, failed_electrode, "missing", "missing|zero",
                 "What is recorded while an electrode is off."),
    CLOCK_OPTIONS(mhi_emg_noise, 0),
};

static const mhe_option raw_emg_options[] = {
    MHE_OPT_MAP(mhi_raw_emg, electrodes, 0,
                "Electrode: the muscles that it reads, 'BicepsLong 0.5, BicepsShort 0.5'; none: no "
                "raw EMG."),
    MHE_OPT_REALS(mhi_raw_emg, mvc, 0, 1e-9, 1, "V",
                  "Mean rectified signal at an excitation of 1: one of all electrodes or one each; "
                  "none: 0.001."),
    MHE_OPT_REAL(mhi_raw_emg, band_low, 20, 0.001, 1e5, "Hz", "Lower corner of the signal's band."),
    MHE_OPT_REAL(mhi_raw_emg, band_high, 450, 0.001, 1e5, "Hz",
                 "Upper corner of the signal's band."),
    MHE_OPT_REAL(mhi_raw_emg, amplifier_sd, 0, 0, 1, "V",
                 "Spread of white noise that is there without a contraction too."),
    CLOCK_OPTIONS(mhi_raw_emg, 2000),
};

static const mhe_option output_options[] = {
    MHE_OPT_BOOL(mhi_noise_output, picture, 1,
                 "Draw EMG without and with noise, where gnuplot is installed."),
    MHE_OPT_REALS(mhi_noise_output, levels, 0, 0, 100, "1",
                  "EMG levels in the picture; none: the one of noise.emg."),
};

/* In the order of the file; a name with a dot is a section in a section. */
#define SECTION(name, help, table, offset) \
    { name, help, NULL, table, (int32_t)(sizeof(table) / sizeof((table)[0])), offset, 0 }
#define AT(field) ((uint32_t)offsetof(mhi_noise_config, field))

static const mhi_section sections[] = {
    SECTION("", "Top level of the file.", top_options, 0),
    SECTION("noise", "What the instruments add.", noise_options, AT(noise)),
    SECTION("noise.markers", "Errors of the markers.", marker_options, AT(noise.markers)),
    SECTION("noise.emg", "Errors of the EMG.", emg_options, AT(noise.emg)),
    SECTION(
        "noise.raw_emg",
        "Raw EMG of electrodes, in recording.c3d with the markers; nothing of noise.emg is in it.",
        raw_emg_options, AT(noise.raw_emg)),
    SECTION("output", "What is made of the results.", output_options, AT(output)),
};
#define N_SECTIONS ((int32_t)(sizeof sections / sizeof sections[0]))

/* "emg" of "noise.emg" in "noise"; NULL where `name` is not right below `parent`. */
static const char *name_below(const char *name, const char *parent) {
    const char *dot = strrchr(name, '.');
    const size_t head = dot != NULL ? (size_t)(dot - name) : 0;
    if (*name == '\0' || head != strlen(parent) || strncmp(name, parent, head) != 0) {
        return NULL;
    }
    return dot != NULL ? dot + 1 : name;
}

static const mhi_node *section_node(const mhi_tree *tree, const char *name) {
    const mhi_node *node = mhi_tree_root(tree);
    while (*name != '\0' && node != NULL) {
        char key[32];
        const size_t n = strcspn(name, ".");
        (void)snprintf(key, sizeof key, "%.*s", (int)n, name);
        node = mhi_node_find(node, key);
        name += name[n] == '.' ? n + 1 : n;
    }
    return node;
}

/* Where a file's sections are read from and to. */
typedef struct noise_source {
    const mhi_tree *tree;
    const char *dir;
    mhi_arena *arena;
} noise_source;

static mhe_status read_section(const noise_source *source, mhi_noise_config *config,
                               const mhi_section *s, mhe_error *err) {
    const char *others[N_SECTIONS + 1]; /* keys of this mapping that are sections */
    int32_t n = 0;
    for (int32_t i = 0; i < N_SECTIONS; i++) {
        const char *name = name_below(sections[i].name, s->name);
        if (name != NULL) {
            others[n++] = name;
        }
    }
    if (*s->name == '\0') {
        others[n++] = "model";
    }
    return mhi_options_fill(s->options, s->n_options, source->tree,
                            section_node(source->tree, s->name), others, n,
                            *s->name == '\0' ? NULL : s->name, source->dir, source->arena,
                            (unsigned char *)config + s->offset, err);
}

static void set_places(mhi_noise *noise, const mhi_tree *tree) {
    noise->tree = tree;
    noise->markers.node = section_node(tree, "noise.markers");
    noise->emg.node = section_node(tree, "noise.emg");
    noise->raw_emg.node = section_node(tree, "noise.raw_emg");
}

mhe_status mhi_noise_config_read(const char *path, const char *const *set, int32_t n_set,
                                 mhi_registry *registry, mhi_noise_config *config, mhe_error *err) {
    *config = (mhi_noise_config){0};
    mhe_status status = mhi_run_read_model(path, set, n_set, registry, &config->run, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_run *run = config->run;
    const noise_source source = {run->tree, run->dir, &run->arena};
    for (int32_t i = 0; i < N_SECTIONS && status == MHE_OK; i++) {
        status = read_section(&source, config, &sections[i], err);
    }
    if (status == MHE_OK && config->output.levels.n > MHI_NOISE_LEVELS_MAX) {
        status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, section_node(run->tree, "output"),
                             "output: 'levels' has %d values; %d can be shown",
                             config->output.levels.n, MHI_NOISE_LEVELS_MAX);
    }
    set_places(&config->noise, run->tree);
    return status;
}

mhe_status mhi_noise_read(const mhi_tree *tree, mhi_arena *arena, mhi_noise *noise,
                          mhe_error *err) {
    static const char name[] = "noise";
    const noise_source source = {tree, NULL, arena};
    mhi_noise_config config = {0};
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < N_SECTIONS && status == MHE_OK; i++) {
        if (strncmp(sections[i].name, name, sizeof name - 1) == 0) {
            status = read_section(&source, &config, &sections[i], err);
        }
    }
    if (status == MHE_OK && section_node(tree, "noise.raw_emg") != NULL) {
        status = mhi_fail_at(err, MHE_E_CONFIG, tree, section_node(tree, "noise.raw_emg"),
                             "noise: 'raw_emg' is for recordings that are written to files");
    }
    *noise = config.noise;
    set_places(noise, tree);
    return status;
}

void mhi_noise_config_free(mhi_noise_config *config) {
    mhi_run_free(config->run);
    *config = (mhi_noise_config){0};
}

void mhi_noise_config_write(const mhi_noise_config *config, mhi_text *out) {
    mhi_text_add(out, "# Every key of this recording with its value.\nmodel:\n");
    mhi_run_write_model(config->run, 2, out);
    for (int32_t i = 0; i < N_SECTIONS; i++) {
        const mhi_section *s = &sections[i];
        const char *dot = strchr(s->name, '.');
        const int32_t depth = *s->name == '\0' ? 0 : dot == NULL ? 1 : 2;
        if (depth > 0) {
            mhi_text_add(out, "%*s%s:\n", 2 * (depth - 1), "", dot == NULL ? s->name : dot + 1);
        }
        mhi_options_write(s->options, s->n_options, (const unsigned char *)config + s->offset,
                          2 * depth, out);
    }
}

void mhi_noise_config_describe(mhi_text *out) {
    for (int32_t i = 0; i < N_SECTIONS; i++) {
        const mhi_section *s = &sections[i];
        mhi_text_add(out, "%s%s: %s\n", i == 0 ? "" : "\n",
                     *s->name == '\0' ? "(top level)" : s->name, s->help);
        mhi_options_text(s->options, s->n_options, out);
    }
}
