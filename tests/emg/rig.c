/* SPDX-License-Identifier: Apache-2.0 */
#include "rig.h"

#include "base/pi.h"
#include "config/options.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

mhi_emg_section rig_options(void) {
    mhi_emg_section options = {0};
    mhi_arena arena = {0};
    mhe_error err = {0};
    int32_t n = 0;
    const mhe_option *table = mhi_run_section("emg", &n);
    (void)mhi_options_fill(table, n, NULL, NULL, NULL, 0, "emg", NULL, &arena, &options, &err);
    mhi_arena_free(&arena);
    options.delay = 0;
    return options;
}

static void listen(const mhe_host *host, int32_t level, const char *text) {
    emg_rig *rig = host->data;
    const size_t used = strlen(rig->told);
    (void)level;
    rig->n_told++;
    (void)snprintf(rig->told + used, sizeof rig->told - used, "%s\n", text);
}

void rig_open(emg_rig *rig) {
    static mhe_muscle muscles[3];
    static const char *const a[] = {"biceps", "brachialis"}, *const b[] = {"triceps"};
    static const double gains[] = {1, 0.5};
    const char *const names[] = {"biceps", "triceps", "brachialis"};
    *rig = (emg_rig){.host = {.size = sizeof rig->host, .log = listen}};
    rig->host.data = rig;
    for (int i = 0; i < 3; i++) {
        muscles[i].name = names[i];
    }
    rig->model.muscles = muscles;
    rig->model.n_muscles = 3;
    rig->run.emg = rig_options();
    rig->run.emg.n_channels = 2;
    rig->run.emg.channels = calloc(2, sizeof(mhi_emg_channel));
    rig->run.emg.channels[0] = (mhi_emg_channel){
        .name = "A", .muscles = {a, 2}, .gains = {gains, 2}, .gain = 1, .mvc = 0.001};
    rig->run.emg.channels[1] =
        (mhi_emg_channel){.name = "B", .muscles = {b, 1}, .gain = 1, .mvc = 1};
}

void rig_close(emg_rig *rig) {
    free(rig->run.emg.channels);
}

double rig_force(double time) {
    return 0.4 - 0.3 * cos(2 * MHI_PI * time);
}

mhi_table *rig_table(int32_t n_rows) {
    static const char *const labels[] = {"spare", "A", "B"};
    mhi_table *t = calloc(1, sizeof *t);
    t->path = strdup("raw.sto");
    t->n_rows = n_rows;
    t->n_columns = t->n_labels = 3;
    t->labels = calloc(3, sizeof *t->labels);
    t->time = malloc(sizeof(double) * (size_t)n_rows);
    t->values = malloc(sizeof(double) * 3 * (size_t)n_rows);
    t->rate = RIG_RATE;
    for (int i = 0; i < 3; i++) {
        t->labels[i] = strdup(labels[i]);
    }
    for (int32_t k = 0; k < n_rows; k++) {
        const double time = k / RIG_RATE, carrier = sin(2 * MHI_PI * 95 * time);
        t->time[k] = time;
        t->values[3 * k] = 1;
        t->values[3 * k + 1] = 0.001 * carrier * rig_force(time);
        t->values[3 * k + 2] = 0.5 * carrier;
    }
    return t;
}

mhe_status rig_read(emg_rig *rig, mhi_table *table, int32_t n_frames, double *emg) {
    double *time = malloc(sizeof(double) * (size_t)n_frames);
    for (int32_t k = 0; k < n_frames; k++) {
        time[k] = k / 100.0;
    }
    const mhe_status status =
        mhi_electrodes_read(&rig->run, &rig->model, table, time, n_frames, 0.01, emg, &rig->n_found,
                            &rig->report, &rig->host, &rig->err);
    free(time);
    return status;
}
