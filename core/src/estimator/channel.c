/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/channel.h"

#include <math.h>
#include <string.h>

/* How much EMG may vary (of 1) of which little was seen, a variance that falls to the e-th part
 * within SEEN_AFTER. A posture that begins wrong is held by EMG that is believed too much; measured
 * velocities hold the motion themselves. */
#define UNSEEN 0.1
#define UNSEEN_WITH_RATES 0.05
#define SEEN_AFTER 0.5 /* s */

/* A row of the table before it has memory. A further quantity is a further row. */
typedef struct row_setup {
    const char *name;
    int32_t signal, posture, trust;
    int32_t gap_rule, gap_nodes; /* the gap in intervals */
    int32_t frames;
    int32_t n_labels, per_label;
    const char *const *labels;
} row_setup;

static double *row_of(double *values, int32_t k, int32_t width) {
    return values + (ptrdiff_t)k * width;
}

/* "WRIST.x" where there are several values a label. */
static mhe_status name_columns(const row_setup *s, mhi_arena *arena, mhi_channel *c,
                               mhe_error *err) {
    const char **columns = MHI_TAKE(arena, const char *, c->face.width);
    for (int32_t i = 0; i < c->face.width && columns != NULL; i++) {
        const char *label = s->labels[i / s->per_label];
        columns[i] = s->per_label == 1
                         ? label
                         : mhi_arena_format(arena, "%s.%c", label, "xyz"[i % s->per_label]);
        columns = columns[i] == NULL ? NULL : columns;
    }
    c->face.columns = columns;
    return columns == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static mhe_status name_units(const mhe_description *d, const mhi_signal *signal, mhi_arena *arena,
                             mhi_channel *c, mhe_error *err) {
    const char **units = MHI_TAKE(arena, const char *, c->face.width);
    for (int32_t i = 0; i < c->face.width && units != NULL; i++) {
        const int32_t of_q = c->signal == MHI_SIGNAL_Q || c->signal == MHI_SIGNAL_QDOT;
        const int32_t slides = of_q && !d->coordinates[i].rotational;
        units[i] = !slides ? signal->unit : c->signal == MHI_SIGNAL_Q ? "m" : "m/s";
    }
    c->face.units = units;
    return units == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static mhe_status take_rows(mhi_channel *c, int32_t nodes, mhi_arena *arena, mhe_error *err) {
    const ptrdiff_t width = c->face.width, n = nodes * width;
    c->measured = MHI_TAKE(arena, double, n);
    c->believed = MHI_TAKE(arena, double, n);
    c->why = MHI_TAKE(arena, int32_t, n);
    c->late = MHI_TAKE(arena, uint8_t, n);
    c->sums = MHI_TAKE(arena, double, 6 * width);
    c->n_in_mean = MHI_TAKE(arena, int32_t, width);
    c->line = MHI_TAKE(arena, double, (c->frames + 1) * width);
    c->absent = MHI_TAKE(arena, double, width);
    c->found = MHI_TAKE(arena, double, width);
    c->varied = MHI_TAKE(arena, double, width);
    if (!c->measured || !c->believed || !c->why || !c->late || !c->sums || !c->n_in_mean ||
        !c->line || !c->absent || !c->found || !c->varied) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (ptrdiff_t i = 0; i < width; i++) {
        c->absent[i] = NAN;
    }
    for (int32_t k = 0; k < nodes; k++) {
        mhi_channel_set(c, k, c->absent);
    }
    c->samples = (mhi_samples){.width = c->face.width, .changed = INFINITY};
    return MHE_OK;
}

static mhe_status create_row(const row_setup *s, const mhi_ocp *ocp, const mhe_description *d,
                             int32_t nodes, mhi_arena *arena, mhi_channel *c, mhe_error *err) {
    const mhi_signal *signal = &mhi_ocp_signals(ocp)->signal[s->signal];
    *c = (mhi_channel){.face = {.size = sizeof c->face,
                                .kind = MHE_CHANNEL_TARGET,
                                .name = s->name,
                                .signal = signal->name,
                                .width = s->n_labels * s->per_label,
                                .n_labels = s->n_labels,
                                .per_label = s->per_label,
                                .labels = s->labels,
                                .gap_rule = s->gap_rule},
                       .signal = s->signal,
                       .posture = s->posture,
                       .trust = s->trust,
                       .read = mhi_ocp_reads(ocp, s->signal),
                       .frames = s->frames,
                       .gap_nodes = s->gap_nodes,
                       .counts = {.size = sizeof c->counts}};
    mhe_status status = name_columns(s, arena, c, err);
    if (status == MHE_OK) {
        status = name_units(d, signal, arena, c, err);
    }
    return status == MHE_OK ? take_rows(c, nodes, arena, err) : status;
}

static int32_t is_measured(const mhi_ocp *ocp, const mhe_block *block) {
    return block->role == MHE_ROLE_INPUT &&
           mhi_system_input_is_measured(mhi_ocp_system(ocp), block->name);
}

/* An input block of a force that comes with the frames. */
static mhe_status create_input(const mhe_block *b, int32_t nodes, mhi_arena *arena, mhi_channel *c,
                               mhe_error *err) {
    *c = (mhi_channel){.face = {.size = sizeof c->face,
                                .kind = MHE_CHANNEL_INPUT,
                                .name = b->name,
                                .width = b->count,
                                .n_labels = b->count,
                                .per_label = 1,
                                .labels = b->entry_names,
                                .columns = b->entry_names,
                                .units = b->units,
                                .gap_rule = MHE_GAP_HOLD},
                       .signal = -1,
                       .input = b->first,
                       .trust = MHI_TRUST_ALL,
                       .read = 1,
                       .gap_nodes = 2,
                       .counts = {.size = sizeof c->counts}};
    return take_rows(c, nodes, arena, err);
}

mhe_status mhi_channels_create(const mhi_run *run, const mhi_ocp *ocp, const mhe_description *d,
                               int32_t nodes, mhi_arena *arena, mhi_channels *channels,
                               mhe_error *err) {
    const mhe_problem *p = mhi_ocp_problem(ocp);
    const int32_t control = p->formulation == MHE_FORMULATION_EXCITATION ? MHI_SIGNAL_EXCITATION
                                                                         : MHI_SIGNAL_ACTIVATION;
    const int32_t emg_rule = run->emg.sample == MHI_EMG_SAMPLE_MEAN ? MHE_GAP_MEAN : MHE_GAP_HOLD;
    const row_setup setups[] = {{"markers", MHI_SIGNAL_MARKERS, 1, MHI_TRUST_POSITION,
                                 MHE_GAP_LINEAR, 2, 0, p->n_markers, 3, p->marker_names},
                                {"emg", control, 0, MHI_TRUST_RAILS, emg_rule, 1,
                                 run->data.emg_delay, p->n_muscles, 1, p->muscle_names},
                                {"angles", MHI_SIGNAL_Q, 1, MHI_TRUST_ALL, MHE_GAP_LINEAR, 2, 0,
                                 p->n_q, 1, p->coordinate_names},
                                {"rates", MHI_SIGNAL_QDOT, 0, MHI_TRUST_ALL, MHE_GAP_LINEAR, 2, 0,
                                 p->n_q, 1, p->coordinate_names}};
    const int32_t n_targets = (int32_t)(sizeof setups / sizeof setups[0]) - !run->data.rates;
    int32_t n = n_targets;
    for (int32_t b = 0; b < p->layout->n_blocks; b++) {
        n += is_measured(ocp, mhe_layout_at(p->layout, b));
    }
    *channels = (mhi_channels){.n = n,
                               .nodes = nodes,
                               .rows = MHI_TAKE(arena, mhi_channel, n),
                               .faces = MHI_TAKE(arena, mhe_channel, n)};
    if (channels->rows == NULL || channels->faces == NULL) {
        channels->n = 0;
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n_targets && status == MHE_OK; i++) {
        status = create_row(&setups[i], ocp, d, nodes, arena, &channels->rows[i], err);
        channels->rows[i].unseen = run->data.rates ? UNSEEN_WITH_RATES : UNSEEN;
    }
    for (int32_t b = 0, i = n_targets; b < p->layout->n_blocks && status == MHE_OK; b++) {
        const mhe_block *block = mhe_layout_at(p->layout, b);
        if (is_measured(ocp, block)) {
            status = create_input(block, nodes, arena, &channels->rows[i++], err);
        }
    }
    for (int32_t i = 0; i < n; i++) {
        channels->faces[i] = channels->rows[i].face;
    }
    return status;
}

void mhi_channels_free(mhi_channels *channels) {
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_samples_free(&channels->rows[i].samples);
    }
}

void mhi_channels_set_interval(mhi_channels *channels, double interval, int32_t ratio) {
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_channel *c = &channels->rows[i];
        c->interval = interval;
        c->face.gap = c->gap_nodes * interval;
        c->span = c->face.gap_rule == MHE_GAP_MEAN ? interval : 0;
        c->face.delay = c->frames * interval / ratio;
        c->samples.changed = c->samples.n > 0 ? -INFINITY : INFINITY; /* for every node */
        channels->faces[i] = c->face;
    }
}

mhi_channel *mhi_channels_find(const mhi_channels *channels, int32_t signal) {
    for (int32_t i = 0; i < channels->n; i++) {
        if (channels->rows[i].signal == signal) {
            return &channels->rows[i];
        }
    }
    return NULL;
}

const double *mhi_channels_of_frame(const mhi_channels *channels, int32_t i,
                                    const mhe_frame *frame) {
    const mhi_channel *c = &channels->rows[i];
    const double *values = NULL;
    if (frame->channels != NULL && i < frame->n_channels) {
        values = frame->channels[i];
    }
    if (values == NULL) {
        values = strcmp(c->face.name, "markers") == 0  ? frame->markers
                 : strcmp(c->face.name, "emg") == 0    ? frame->emg
                 : strcmp(c->face.name, "angles") == 0 ? frame->angles
                                                       : NULL;
    }
    return values == NULL ? c->absent : values;
}

const double *mhi_channel_delayed(const mhi_channels *channels, int32_t i, const double *values) {
    const mhi_channel *c = &channels->rows[i];
    const int64_t slots = c->frames + 1, n = channels->n_frames;
    const int32_t put = (int32_t)(n % slots), get = (int32_t)((n + 1) % slots);
    for (int32_t slot = 0; slot < slots; slot++) {
        if (slot == put || n == 0) {
            memcpy(row_of(c->line, slot, c->face.width), values,
                   sizeof(double) * (size_t)c->face.width);
        }
    }
    return row_of(c->line, get, c->face.width);
}

void mhi_channel_set(mhi_channel *c, int32_t k, const double *values) {
    const int32_t width = c->face.width;
    const ptrdiff_t at = (ptrdiff_t)k * width;
    memcpy(c->measured + at, values, sizeof(double) * (size_t)width);
    memcpy(c->believed + at, values, sizeof(double) * (size_t)width);
    for (int32_t i = 0; i < width; i++) {
        c->why[at + i] = isnan(values[i]) ? MHE_TRACK_MISSING : MHE_TRACK_USED;
        c->late[at + i] = (uint8_t)(c->why[at + i] == MHE_TRACK_MISSING);
        c->n_in_mean[i] = !isnan(values[i]);
    }
}

void mhi_channel_add(mhi_channel *c, int32_t k, const double *values) {
    const ptrdiff_t at = (ptrdiff_t)k * c->face.width;
    for (int32_t i = 0; i < c->face.width && c->face.gap_rule == MHE_GAP_MEAN; i++) {
        double *measured = &c->measured[at + i];
        if (isnan(values[i]) || (c->late[at + i] && !isnan(*measured))) {
            continue; /* nothing new, or what samples say of the node */
        }
        c->n_in_mean[i]++;
        *measured =
            isnan(*measured) ? values[i] : *measured + (values[i] - *measured) / c->n_in_mean[i];
        c->late[at + i] = 0;
        if (c->why[at + i] == MHE_TRACK_MISSING || c->why[at + i] == MHE_TRACK_USED) {
            c->believed[at + i] = *measured;
            c->why[at + i] = MHE_TRACK_USED;
        }
    }
}

void mhi_channel_believe(mhi_channel *c, int32_t nodes) {
    const ptrdiff_t n = (ptrdiff_t)nodes * c->face.width;
    memcpy(c->believed, c->measured, sizeof(double) * (size_t)n);
    for (ptrdiff_t i = 0; i < n; i++) {
        c->why[i] = isnan(c->measured[i]) ? MHE_TRACK_MISSING : MHE_TRACK_USED;
    }
}

int32_t mhi_channel_any(const double *values, int32_t n) {
    int32_t found = 0;
    for (int32_t i = 0; i < n && !found; i++) {
        found = !isnan(values[i]);
    }
    return found;
}

/* Node k into the sums of a channel's values: number, values, squares [width] each. */
static void add_to_sums(const mhi_channel *c, int32_t k, double *sums) {
    const int32_t width = c->face.width;
    const double *values = c->measured + (ptrdiff_t)k * width;
    for (int32_t i = 0; i < width; i++) {
        if (!isnan(values[i])) {
            sums[i]++;
            sums[width + i] += values[i];
            sums[2 * width + i] += values[i] * values[i];
        }
    }
}

void mhi_channel_spread(mhi_channel *c, int32_t filled, double *spread) {
    const int32_t width = c->face.width;
    double *now = c->sums + 3 * width;
    memcpy(now, c->sums, 3 * sizeof *now * (size_t)width);
    for (int32_t k = 0; k < filled; k++) {
        add_to_sums(c, k, now);
    }
    for (int32_t i = 0; i < width; i++) {
        const double n = now[i], mean = now[width + i] / n;
        const double square = n > 0 ? fmax(0, now[2 * width + i] / n - mean * mean) : NAN;
        const double unseen =
            c->seen ? 0 : c->unseen * c->unseen * exp(-n * c->interval / SEEN_AFTER);
        c->varied[i] = sqrt(square);
        spread[i] = sqrt(square + unseen);
    }
}

void mhi_channel_compare(mhi_channel *c, const double *estimated, const double *believed) {
    for (int32_t i = 0; i < c->face.width; i++) {
        const double d = estimated[i] - believed[i];
        c->misfit += isnan(d) ? 0 : d * d;
        c->n_misfit += !isnan(d);
    }
}

void mhi_channels_shift(mhi_channels *channels, int32_t filled) {
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_channel *c = &channels->rows[i];
        const size_t width = (size_t)c->face.width, rest = (size_t)(channels->nodes - 1) * width;
        if (filled > 0) {
            c->counts.n_nodes++;
            add_to_sums(c, 0, c->sums);
            c->counts.n_empty += !mhi_channel_any(c->measured, c->face.width);
        }
        memmove(c->measured, c->measured + width, sizeof(double) * rest);
        memmove(c->believed, c->believed + width, sizeof(double) * rest);
        memmove(c->why, c->why + width, sizeof(int32_t) * rest);
        memmove(c->late, c->late + width, rest);
    }
}
