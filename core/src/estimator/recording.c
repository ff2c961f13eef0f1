/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/recording_private.h"

#include "base/pi.h"
#include "believe/believe.h"
#include "estimator/marker_unit.h"
#include "estimator/tasks.h"
#include "io/motion_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Markers of weight 0 are as if never measured: neither they nor their distances say anything. */
static mhe_status leave_out(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                            mhe_error *err) {
    mhi_arena arena = {0};
    const mhi_tasks *tasks = NULL;
    const mhe_status status = mhi_tasks_read(run, d, NULL, &arena, &tasks, err);
    const ptrdiff_t n = (ptrdiff_t)r->n_frames * 3 * d->n_markers;
    for (ptrdiff_t i = 0; i < n && tasks != NULL; i++) {
        if (tasks->marker[i / 3 % d->n_markers] == 0) {
            r->markers[i] = NAN;
        }
    }
    mhi_arena_free(&arena);
    return status;
}

static mhe_status read_markers(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                               const mhe_host *host, mhe_error *err) {
    static const mhi_naming naming = {"marker", {"%s"}, 1};
    mhi_table *table = NULL;
    mhe_status status = mhi_markers_read(run->data.markers, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    const char **names = mhi_recording_names(d, 'k', d->n_markers);
    status = names == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                           : mhi_recording_check_table(table, host, err);
    if (status == MHE_OK) {
        status = mhi_recording_name(r, run, table, 3, err);
    }
    if (status == MHE_OK) {
        status = mhi_recording_set_times(r, table, err);
    }
    if (status == MHE_OK) {
        r->unit = table->unit;
        memcpy(r->unit_name, table->unit_name, sizeof r->unit_name);
        status = mhi_recording_columns(r, table, &naming, names, d->n_markers, 3, 0, &r->markers,
                                       &r->n_markers_found, host, err);
    }
    if (status == MHE_OK) {
        const double scale = fabs(run->transform.scale);
        mhi_marker_leave_out_distant(r, d->n_markers, table->path, host);
        mhi_marker_settle_unit(r, d, scale > 0 ? scale : 1, table->path, host);
        for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * d->n_markers; i++) {
            mhi_run_transform(run, 1, r->markers + 3 * i);
        }
    }
    if (status == MHE_OK) {
        status = leave_out(r, run, d, err);
    }
    free(names);
    mhi_table_free(table);
    return status;
}

/* Angles of a file in degrees. */
static void to_radians(double *values, int32_t n_frames, const mhe_description *d) {
    const double factor = MHI_PI / 180;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)n_frames * d->n_coordinates; i++) {
        values[i] *= d->coordinates[i % d->n_coordinates].rotational ? factor : 1;
    }
}

/* OpenSim's states are called by paths: "/jointset/hip_r/hip_flexion_r/value". */
static void shorten_paths(mhi_table *table) {
    for (int32_t i = 0; i < table->n_labels; i++) {
        char *label = table->labels[i], *end = strrchr(label, '/');
        if (label[0] == '/' && end != label && strcmp(end, "/value") == 0) {
            *end = '\0';
            const char *name = strrchr(label, '/') + 1;
            memmove(label, name, strlen(name) + 1);
        }
    }
}

/* Measured joint angles; without markers their times are the frames'. */
static mhe_status read_angles(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                              const mhe_host *host, const mhe_host *told, mhe_error *err) {
    static const mhi_naming naming = {"coordinate", {"%s", "q_%s"}, 1};
    mhi_table *table = NULL;
    mhe_status status = mhi_sto_read(run->data.angles, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    shorten_paths(table);
    const char **names = mhi_recording_names(d, 'q', d->n_coordinates);
    int32_t n_found = 0;
    status = names == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                           : mhi_recording_check_table(table, host, err);
    if (status == MHE_OK) {
        status = mhi_recording_name(r, run, table, 1, err);
    }
    if (status == MHE_OK && r->time == NULL) {
        status = mhi_recording_set_times(r, table, err);
    }
    if (status == MHE_OK) {
        status = mhi_recording_columns(r, table, &naming, names, d->n_coordinates, 1, 0, &r->angles,
                                       &n_found, host, err);
    }
    if (status == MHE_OK && table->in_degrees) {
        to_radians(r->angles, r->n_frames, d);
    }
    if (status == MHE_OK) {
        const mhi_angles_source source = {table->path, table->line, table->in_degrees};
        const int32_t from = r->findings.n;
        status = mhi_believe_angles(d, r, &source, &r->findings, err);
        mhi_findings_tell(&r->findings, from, told);
    }
    free(names);
    mhi_table_free(table);
    return status;
}

static mhe_status read_reference(mhi_recording *r, const char *path, const mhe_description *d,
                                 const mhe_host *host, mhe_error *err) {
    static const mhi_naming q = {"coordinate", {"q_%s", "%s", "q%d"}, 0};
    static const mhi_naming v = {"speed", {"qdot_%s", "%s_u", "%s/speed", "qdot%d"}, 0};
    static const mhi_naming a = {"activation", {"a_%s", "%s.activation", "%s/activation"}, 0};
    static const mhi_naming e = {"excitation", {"e_%s", "%s.excitation"}, 0};
    static const mhi_naming f = {"force", {"F_%s"}, 0};
    mhi_table *table = NULL;
    mhe_status status = mhi_sto_read(path, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    const int32_t n_q = d->n_coordinates, n_m = d->n_muscles;
    const char **coordinates = mhi_recording_names(d, 'q', n_q);
    const char **muscles = mhi_recording_names(d, 'm', n_m);
    status = coordinates == NULL || muscles == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                    : mhi_recording_check_table(table, host, err);
    if (status == MHE_OK && r->time == NULL) {
        status = mhi_recording_set_times(r, table, err);
    }
    struct {
        const mhi_naming *naming;
        const char *const *names;
        int32_t n, hold;
        double **out;
    } wanted[] = {{&q, coordinates, n_q, 0, &r->reference.q},
                  {&v, coordinates, n_q, 0, &r->reference.qdot},
                  {&a, muscles, n_m, 0, &r->reference.activation},
                  {&e, muscles, n_m, 1, &r->reference.excitation},
                  {&f, muscles, n_m, 0, &r->reference.force}};
    int32_t found[5] = {0};
    for (size_t i = 0; i < 5 && status == MHE_OK; i++) {
        status = mhi_recording_columns(r, table, wanted[i].naming, wanted[i].names, wanted[i].n, 1,
                                       wanted[i].hold, wanted[i].out, &found[i], host, err);
    }
    if (status == MHE_OK && found[0] < n_q) {
        char hint[256];
        status = mhe_fail(err, MHE_E_INPUT,
                          "%s: the reference has %d of the model's %d coordinates%s", table->path,
                          found[0], n_q, mhi_suggest(hint, sizeof hint, "", coordinates, n_q));
    }
    if (status == MHE_OK && table->in_degrees) {
        to_radians(r->reference.q, r->n_frames, d);
        to_radians(r->reference.qdot, r->n_frames, d);
    }
    r->reference.present = status == MHE_OK;
    free(coordinates);
    free(muscles);
    mhi_table_free(table);
    return status;
}

static mhi_recording *new_recording(void) {
    mhi_recording *r = calloc(1, sizeof *r);
    if (r != NULL) {
        r->unit = 1;
        memcpy(r->unit_name, "m", 2);
    }
    return r;
}

mhe_status mhi_recording_read_reference(const char *path, const mhe_description *d,
                                        const mhe_host *host, mhi_recording **recording,
                                        mhe_error *err) {
    *recording = NULL;
    mhi_recording *r = new_recording();
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = read_reference(r, path, d, host, err);
    if (status != MHE_OK) {
        mhi_recording_free(r);
        return status;
    }
    *recording = r;
    return MHE_OK;
}

/* A host that also notes what it is told: all that is left out of a recording stands in its
 * findings. */
typedef struct noting_host {
    mhe_host host;
    const mhe_host *told;
    mhi_findings *findings;
} noting_host;

static void note_line(const mhe_host *host, int32_t level, const char *text) {
    const noting_host *own = (const noting_host *)(const void *)host;
    if (level <= MHE_LOG_WARNING) {
        mhi_findings_add(own->findings, MHI_FINDING_NOTE, "", "%s", text);
    }
    own->told->log(own->told, level, text);
}

mhe_status mhi_recording_read(const mhi_run *run, const mhe_description *d, const mhe_host *told,
                              mhi_recording **recording, mhe_error *err) {
    *recording = NULL;
    const mhi_data_section *data = &run->data;
    const char *source = data->markers != NULL  ? data->markers
                         : data->angles != NULL ? data->angles
                                                : data->emg;
    if (source == NULL) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "%s: data: neither 'markers' nor 'angles' nor 'emg' is given: there is "
                        "nothing to estimate from",
                        run->path);
    }
    mhi_recording *r = new_recording();
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    noting_host noting = {*told, told, &r->findings};
    noting.host.log = note_line;
    const mhe_host *host = &noting.host;
    int32_t told_from = 0;
    mhe_status status = MHE_OK;
    if (run->data.markers != NULL) {
        status = read_markers(r, run, d, host, err);
    }
    r->n_q = d->n_coordinates;
    if (status == MHE_OK && data->angles != NULL) {
        status = read_angles(r, run, d, host, told, err);
    }
    if (status == MHE_OK && run->data.emg != NULL) {
        status = mhi_recording_read_emg(r, run, d, host, err);
    }
    if (status == MHE_OK) {
        told_from = r->findings.n;
        status = mhi_believe_emg(run, d, r, &r->findings, err);
    }
    if (status == MHE_OK) {
        mhi_believe_markers(run, d, r, &r->findings);
        status = mhi_believe_loads(run, d, r, &r->findings, err);
        mhi_findings_tell(&r->findings, told_from, told);
    }
    if (status == MHE_OK && run->data.reference != NULL) {
        status = read_reference(r, run->data.reference, d, host, err);
    }
    const int64_t span = (int64_t)run->horizon.window * run->horizon.ratio;
    if (status == MHE_OK) {
        mhi_recording_warn_labels(r, run, host);
        mhi_recording_warn_uneven(r, source, ((double)span + 0.5) / r->rate, host);
    }
    if (status == MHE_OK && r->n_frames <= span) {
        status = mhe_fail(
            err, MHE_E_INPUT,
            "%s: %d frames are too few for a window of %d intervals at ratio %d, which needs %lld",
            source, r->n_frames, run->horizon.window, run->horizon.ratio, (long long)span + 1);
    }
    if (status != MHE_OK) {
        mhi_recording_free(r);
        return mhi_run_locate_file(run, status, err);
    }
    *recording = r;
    return MHE_OK;
}

mhe_frame mhi_recording_frame(const mhi_recording *r, int32_t n_markers, int32_t n_muscles,
                              int32_t k) {
    return (mhe_frame){.size = sizeof(mhe_frame),
                       .time = r->time[k],
                       .markers =
                           r->markers == NULL ? NULL : r->markers + (ptrdiff_t)k * 3 * n_markers,
                       .emg = r->emg == NULL ? NULL : r->emg + (ptrdiff_t)k * n_muscles,
                       .angles = r->angles == NULL ? NULL : r->angles + (ptrdiff_t)k * r->n_q};
}

void mhi_recording_free(mhi_recording *r) {
    if (r == NULL) {
        return;
    }
    free(r->time);
    free(r->markers);
    free(r->emg);
    free(r->angles);
    free(r->reference.q);
    free(r->reference.qdot);
    free(r->reference.activation);
    free(r->reference.excitation);
    free(r->reference.force);
    free(r->labels_used);
    mhi_findings_free(&r->findings);
    free(r);
}
