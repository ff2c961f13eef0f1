/* SPDX-License-Identifier: Apache-2.0 */
#include "live/inlet.h"

#include "config/tree.h"
#include "estimator/columns.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static double unit_factor(const char *unit, int32_t kind) {
    static const struct {
        const char *name;
        double factor;
        int32_t kind;
    } units[] = {{"mm", 1e-3, MHE_STREAM_MARKERS},
                 {"millimeters", 1e-3, MHE_STREAM_MARKERS},
                 {"millimetres", 1e-3, MHE_STREAM_MARKERS},
                 {"cm", 1e-2, MHE_STREAM_MARKERS},
                 {"centimeters", 1e-2, MHE_STREAM_MARKERS},
                 {"deg", 0.017453292519943295, MHE_STREAM_ANGLES},
                 {"degrees", 0.017453292519943295, MHE_STREAM_ANGLES},
                 {"%", 1e-2, MHE_STREAM_EMG},
                 {"percent", 1e-2, MHE_STREAM_EMG}};
    for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
        if (units[i].kind == kind && strcasecmp(units[i].name, unit) == 0) {
            return units[i].factor;
        }
    }
    return 1;
}

/* The stream as a table without rows, one label a marker, so that the same rules find its columns
 * as those of a file. */
typedef struct labels {
    mhi_table table;
    char **names; /* [n] its own */
    char **came;  /* [n] the same as the sender writes them */
    int32_t n;
} labels;

static void free_labels(labels *l) {
    for (int32_t i = 0; i < l->n; i++) {
        free(l->names[i]);
        free(l->came == NULL ? NULL : l->came[i]);
    }
    free(l->names);
    free(l->came);
    free(l->table.path);
}

/* What the config calls a label, else the label. */
static const char *renamed(const mhi_run *run, const char *label) {
    const mhe_text_map *map = &run->data.labels;
    for (int32_t i = 0; i < map->n; i++) {
        if (strcmp(map->keys[i], label) == 0) {
            return map->values[i];
        }
    }
    return label;
}

/* "STER.x": STER */
static void without_axis(const char *label, int32_t per_label, char *out, size_t room) {
    (void)snprintf(out, room, "%s", label);
    const size_t length = strlen(out);
    if (per_label == 3 && length > 2 && out[length - 2] == '.') {
        out[length - 2] = '\0';
    }
}

/* data.subject: his labels lose his name, those of others are set apart, as in files. Returns 1:
 * his, -1: another's, 0: nobody's. */
static int32_t without_subject(const mhi_run *run, char *label, size_t room) {
    const char *subject = run->data.subject;
    const size_t length = mhi_label_subject(label);
    char name[512];
    if (subject == NULL || *subject == '\0' || length == 0) {
        return 0;
    }
    const int32_t own = mhi_label_is_of(label, subject);
    if (own) {
        (void)snprintf(name, sizeof name, "%s", label + length + 1);
    } else {
        (void)snprintf(name, sizeof name, "(%.*s) %s", (int)length, label, label + length + 1);
    }
    (void)snprintf(label, room, "%s", name);
    return own ? 1 : -1;
}

int32_t mhi_inlet_name(const mhi_run *run, const mhi_stream *about, int32_t i, char *out,
                       size_t room) {
    char name[512];
    without_axis(about->labels[i], about->kind == MHE_STREAM_MARKERS ? 3 : 1, name, sizeof name);
    const int32_t whose = about->named[i] ? 1 : without_subject(run, name, sizeof name);
    (void)snprintf(out, room, "%s", about->named[i] ? name : renamed(run, name));
    return whose;
}

static mhe_status no_subject(const mhi_inlet_setup *s, const mhi_stream *about, mhe_error *err) {
    const mhi_table came = {.labels = about->labels, .n_labels = about->n_channels};
    const mhi_run *run = s->run;
    mhi_text others = {0};
    mhi_list_subjects(&came, &others);
    const mhe_status status = mhi_fail_at(
        err, MHE_E_CONFIG, run->tree, mhi_node_find(mhi_tree_root(run->tree), "data"),
        "data.subject: stream '%.100s' has no subject '%s' (it has %.300s)", about->name,
        run->data.subject, others.failed || others.data == NULL ? "others" : others.data);
    mhi_text_free(&others);
    return status;
}

static mhe_status make_labels(const mhi_inlet_setup *s, const mhi_stream *about, labels *l,
                              mhe_error *err) {
    const int32_t per_label = about->kind == MHE_STREAM_MARKERS ? 3 : 1;
    *l = (labels){.n = 0};
    l->names = calloc((size_t)about->n_channels + 1, sizeof *l->names);
    l->came = calloc((size_t)about->n_channels + 1, sizeof *l->came);
    l->table.path = strdup(about->name);
    const int has_room = l->names != NULL && l->came != NULL;
    int32_t n_own = 0, n_others = 0;
    for (int32_t i = 0; has_room && i + per_label <= about->n_channels; i += per_label) {
        char name[512], came[512];
        without_axis(about->came[i], per_label, came, sizeof came);
        const int32_t whose = mhi_inlet_name(s->run, about, i, name, sizeof name);
        n_own += whose > 0;
        n_others += whose < 0;
        l->names[l->n] = strdup(name);
        l->came[l->n] = strdup(came);
        const int whole = l->names[l->n] != NULL && l->came[l->n] != NULL;
        l->n++;
        if (!whole) {
            return no_memory(err);
        }
    }
    l->table.labels = l->names;
    l->table.n_labels = l->n;
    l->table.n_columns = l->n * per_label;
    if (!has_room || l->table.path == NULL) {
        return no_memory(err);
    }
    return n_own == 0 && n_others > 0 ? no_subject(s, about, err) : MHE_OK;
}

/* Labels of the model that the stream lacks, and of the stream that the model has not. */
static mhe_status keep_lists(mhi_inlet *in, const labels *l, const char *const *names, int32_t n,
                             const int32_t *column, const uint8_t *used, mhe_error *err) {
    int32_t n_missing = 0, n_unused = 0;
    in->missing = calloc((size_t)n + 1, sizeof *in->missing);
    in->unused = calloc((size_t)l->n + 1, sizeof *in->unused);
    if (in->missing == NULL || in->unused == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < n; i++) {
        if (column[i] < 0) {
            in->missing[n_missing++] = strdup(names[i]);
        }
    }
    for (int32_t i = 0; i < l->n; i++) {
        if (!used[i]) {
            in->unused[n_unused++] = strdup(l->came[i]);
        }
    }
    return MHE_OK;
}

/* The same for electrodes, which have exactly the names of emg.channels. */
static mhe_status keep_electrodes(mhi_inlet *in, const mhi_run *run, const mhi_stream *about,
                                  mhe_error *err) {
    const int32_t n = run->emg.n_channels;
    int32_t n_missing = 0, n_unused = 0;
    in->missing = calloc((size_t)n + 1, sizeof *in->missing);
    in->unused = calloc((size_t)about->n_channels + 1, sizeof *in->unused);
    if (in->missing == NULL || in->unused == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < n; i++) {
        int32_t found = 0;
        for (int32_t k = 0; k < about->n_channels; k++) {
            found |= strcmp(about->labels[k], run->emg.channels[i].name) == 0;
        }
        if (!found) {
            in->missing[n_missing++] = strdup(run->emg.channels[i].name);
        }
        in->n_found += found;
    }
    for (int32_t k = 0; k < about->n_channels; k++) {
        int32_t used = 0;
        for (int32_t i = 0; i < n; i++) {
            used |= strcmp(about->labels[k], run->emg.channels[i].name) == 0;
        }
        if (!used) {
            in->unused[n_unused++] = strdup(about->came[k]);
        }
    }
    return MHE_OK;
}

static mhe_status match(const mhi_inlet_setup *s, const mhi_stream *about, mhi_inlet *in,
                        const mhe_channel *channel, const labels *l, mhe_error *err) {
    static const mhi_naming namings[] = {
        {"marker", {"%s"}, 1}, {"muscle", {"%s", "e_%s"}, 1}, {"coordinate", {"%s", "q_%s"}, 1}};
    const mhi_naming *naming = &namings[about->kind == MHE_STREAM_MARKERS ? 0
                                        : about->kind == MHE_STREAM_EMG   ? 1
                                                                          : 2];
    const int32_t n = channel->n_labels, per_label = channel->per_label;
    int32_t *column = calloc((size_t)n + 1, sizeof *column);
    uint8_t *used = calloc((size_t)l->n + 1, 1);
    in->column = calloc((size_t)in->width + 1, sizeof *in->column);
    in->factor = calloc((size_t)in->width + 1, sizeof *in->factor);
    in->row = calloc((size_t)in->width + 1, sizeof *in->row);
    mhe_status status = MHE_OK;
    if (column == NULL || used == NULL || in->column == NULL || in->factor == NULL ||
        in->row == NULL) {
        status = no_memory(err);
    } else {
        status = mhi_columns_match(&l->table, naming, channel->labels, n, l->n, column, used,
                                   &in->n_found, s->host, err);
    }
    if (status == MHE_E_INPUT) { /* nothing of it: the others may do */
        s->host->log(s->host, MHE_LOG_WARNING, err->text);
        in->channel = -1;
        in->n_found = 0;
        status = MHE_OK;
        for (int32_t i = 0; i < n; i++) {
            column[i] = -1;
        }
    }
    for (int32_t i = 0; i < in->width && status == MHE_OK; i++) {
        const int32_t label = column[i / per_label];
        in->column[i] = label < 0 ? -1 : label * per_label + i % per_label;
        in->factor[i] = label < 0 ? 1 : unit_factor(about->units[in->column[i]], about->kind);
    }
    if (status == MHE_OK) {
        status = keep_lists(in, l, channel->labels, n, column, used, err);
    }
    free(column);
    free(used);
    return status;
}

static mhe_status open_electrodes(const mhi_inlet_setup *s, const mhi_stream *about, mhi_inlet *in,
                                  mhe_error *err) {
    const int32_t n = s->run->emg.n_channels;
    if (s->run->emg.process && !(about->rate > 0)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "stream '%.150s' says no rate (it is irregular): the filters of raw EMG "
                        "need one; let its program declare it",
                        about->name);
    }
    double *mvc = calloc((size_t)n + 1, sizeof *mvc);
    mhe_status status =
        mvc == NULL ? no_memory(err) : mhi_electrodes_mvc(s->run, s->model, mvc, s->host, err);
    if (status == MHE_OK && s->run->emg.process && s->run->emg.zero_phase) {
        status = mhe_fail(err, MHE_E_CONFIG,
                          "emg.zero_phase looks ahead; live there is nothing "
                          "ahead: take it out");
    }
    if (status == MHE_OK) {
        status =
            mhi_electrodes_open(s->run, s->model, about->name, (const char *const *)about->labels,
                                about->n_channels, about->rate, mvc, &in->electrodes, err);
    }
    if (status == MHE_OK) {
        mhi_electrodes_tell(in->electrodes, s->run, about->name, s->host);
    }
    mhe_error no_lists = {0};
    const mhe_status listed = keep_electrodes(in, s->run, about, &no_lists);
    status =
        status == MHE_OK && listed != MHE_OK ? mhe_fail(err, listed, "%s", no_lists.text) : status;
    in->n_labels = n;
    in->is_raw = 1;
    free(mvc);
    return status;
}

static int32_t find_channel(const mhe_estimator_info *info, int32_t kind) {
    const char *name = kind == MHE_STREAM_MARKERS  ? "markers"
                       : kind == MHE_STREAM_EMG    ? "emg"
                       : kind == MHE_STREAM_ANGLES ? "angles"
                                                   : "";
    for (int32_t i = 0; i < info->n_channels; i++) {
        if (strcmp(mhe_channel_at(info, i)->name, name) == 0) {
            return i;
        }
    }
    return -1;
}

mhe_status mhi_inlet_open(const mhi_inlet_setup *s, const mhi_stream *about, int32_t source,
                          int32_t stream, double delay, mhi_inlet *in, mhe_error *err) {
    *in = (mhi_inlet){.source = source,
                      .stream = stream,
                      .kind = about->kind,
                      .rate = about->rate,
                      .n_channels = about->n_channels,
                      .channel = find_channel(s->info, about->kind),
                      .delay = delay,
                      .newest = -INFINITY};
    in->name = strdup(about->name);
    mhi_stamp_start(&in->stamp, about->rate);
    if (in->name == NULL) {
        return no_memory(err);
    }
    if (in->channel < 0) {
        return MHE_OK;
    }
    const mhe_channel *channel = mhe_channel_at(s->info, in->channel);
    in->width = channel->width;
    in->n_labels = channel->n_labels;
    if (about->kind == MHE_STREAM_EMG && s->run->emg.n_channels > 0) {
        in->row = calloc((size_t)in->width + 1, sizeof *in->row);
        return in->row == NULL ? no_memory(err) : open_electrodes(s, about, in, err);
    }
    labels l;
    mhe_status status = make_labels(s, about, &l, err);
    if (status == MHE_OK) {
        status = match(s, about, in, channel, &l, err);
    }
    free_labels(&l);
    return status;
}

static void free_list(char **list) {
    for (int32_t i = 0; list != NULL && list[i] != NULL; i++) {
        free(list[i]);
    }
    free(list);
}

void mhi_inlet_close(mhi_inlet *in) {
    mhi_electrodes_close(in->electrodes);
    free_list(in->missing);
    free_list(in->unused);
    free(in->name);
    free(in->column);
    free(in->factor);
    free(in->row);
    *in = (mhi_inlet){.channel = -1};
}

void mhi_inlet_take(mhi_inlet *in, const mhi_run *run, const double *values) {
    for (int32_t i = 0; i < in->width; i++) {
        const double value = in->column[i] < 0 ? NAN : values[in->column[i]];
        in->row[i] = isfinite(value) ? in->factor[i] * value : NAN;
    }
    for (int32_t i = 0; in->kind == MHE_STREAM_MARKERS && i + 2 < in->width; i += 3) {
        double *p = in->row + i;
        if (p[0] == 0 && p[1] == 0 && p[2] == 0) { /* how several systems write a gap */
            p[0] = p[1] = p[2] = NAN;
            in->n_zero++;
        } else {
            mhi_run_transform(run, 1, p); /* NaN stays NaN */
        }
    }
}
