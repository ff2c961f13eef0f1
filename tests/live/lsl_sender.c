/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_sender: the demo recording as two streams of the Lab Streaming Layer, by the clock, to and
 * fro until it is killed.
 *
 *     lsl_sender FOLDER NAME PACKET DELAY EMG_RATE [LABEL OTHER]
 *
 * Streams NAME-markers (100 Hz, mm, a sample a frame) and NAME-emg (2000 Hz, thinned to EMG_RATE,
 * in packets of PACKET samples). Each packet of EMG leaves when its last sample is there plus a
 * random delay of up to DELAY seconds; what leaves is in the order of these times whatever the
 * machine does. LABEL: marker that is called OTHER. Where FOLDER has a NAME.pace (lsl_pace.h), it
 * begins when told to and waits for whoever takes its samples. */
#include "lsl_pace.h"
#include "lsl_rig.h"

#include <math.h>
#include <mhe/table.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>

typedef struct sender {
    lsl_rig rig;
    mhe_table_info markers, emg;
    lsl_outlet marker_outlet, emg_outlet;
    int32_t packet, step; /* samples; samples of the recording a sample sent */
    double delay;
    uint64_t seed;
    lsl_pace *pace; /* NULL: it waits for nobody */
} sender;

static double random_of(sender *s) {
    s->seed = s->seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(s->seed >> 11) / 9007199254740992.0;
}

/* Row k of a recording that is played to and fro. */
static int64_t to_and_fro(int64_t k, int32_t n) {
    const int64_t at = k % (2 * ((int64_t)n - 1));
    return at < n ? at : 2 * ((int64_t)n - 1) - at;
}

static int open_streams(sender *s, const char *name, const char *label, const char *other) {
    static const char *const axes[] = {"PositionX", "PositionY", "PositionZ"};
    char text[128];
    lsl_channel channels[512];
    for (int32_t i = 0; i < s->markers.n_columns && i < 512; i++) {
        const char *own = s->markers.labels[i / 3];
        channels[i] = (lsl_channel){label != NULL && strcmp(own, label) == 0 ? other : own, "mm",
                                    axes[i % 3]};
    }
    (void)snprintf(text, sizeof text, "%s-markers", name);
    s->marker_outlet = lsl_rig_send(&s->rig, text, "MoCap", lsl_float32, s->markers.rate, channels,
                                    s->markers.n_columns);
    for (int32_t i = 0; i < s->emg.n_columns && i < 512; i++) {
        channels[i] = (lsl_channel){s->emg.labels[i], "V", "EMG"};
    }
    (void)snprintf(text, sizeof text, "%s-emg", name);
    s->emg_outlet = lsl_rig_send(&s->rig, text, "EMG", lsl_double64, s->emg.rate / s->step,
                                 channels, s->emg.n_columns);
    return s->marker_outlet != NULL && s->emg_outlet != NULL;
}

static void send_frame(sender *s, int64_t k, double stamp) {
    double row[512];
    const int32_t n = s->markers.n_columns;
    const double *from = s->markers.values + to_and_fro(k, s->markers.n_rows) * n;
    for (int32_t i = 0; i < n; i++) {
        row[i] = 1000 * from[i];
    }
    (void)s->rig.lsl.push_sample_dtp(s->marker_outlet, row, stamp, 1);
    lsl_pace_sent(s->pace, LSL_PACE_MARKERS, 1);
}

static void send_packet(sender *s, int64_t first, double start) {
    const int32_t n = s->emg.n_columns;
    for (int32_t i = 0; i < s->packet; i++) {
        const int64_t k = first + i;
        const double stamp = start + (double)(k * s->step) / s->emg.rate;
        (void)s->rig.lsl.push_sample_dtp(s->emg_outlet,
                                         s->emg.values + to_and_fro(k * s->step, s->emg.n_rows) * n,
                                         stamp, i == s->packet - 1);
    }
    lsl_pace_sent(s->pace, LSL_PACE_EMG, s->packet);
}

static void play(sender *s) {
    lsl_pace_wait(s->pace);
    const double clock = s->rig.lsl.local_clock() - lsl_rig_now();
    const double start = lsl_rig_now(), period = s->step / s->emg.rate;
    int64_t frame = 0, sample = 0;
    double due = s->packet * period;
    for (;;) {
        const double next = (double)frame / s->markers.rate, at = fmin(next, due);
        if (lsl_rig_now() < start + at) {
            lsl_rig_rest(start + at - lsl_rig_now());
        }
        if (next <= due) {
            lsl_pace_before_frame(s->pace, frame);
            send_frame(s, frame++, start + next + clock);
        } else {
            send_packet(s, sample, start + clock);
            sample += s->packet;
            /* the next one is there when its last sample is, and not before this one */
            due = fmax(due, (double)(sample + s->packet) * period + s->delay * random_of(s));
        }
    }
}

int main(int argc, char **argv) {
    static const char file[] = MHE_TEST_SOURCE_DIR "/models/arm19/demo_recording.c3d";
    static sender s;
    mhe_table *markers = NULL, *emg = NULL;
    mhe_error err = {0};
    if (argc < 6 || prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || !lsl_rig_open(argv[1], &s.rig)) {
        return 1;
    }
    s.markers.size = sizeof s.markers;
    s.emg.size = sizeof s.emg;
    if (mhe_table_read_markers(file, &markers, &err) != MHE_OK ||
        mhe_table_read_signals(file, &emg, &err) != MHE_OK ||
        mhe_table_describe(markers, &s.markers, &err) != MHE_OK ||
        mhe_table_describe(emg, &s.emg, &err) != MHE_OK || s.markers.n_columns > 512 ||
        s.emg.n_columns > 512) {
        (void)fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    s.packet = atoi(argv[3]);
    s.delay = atof(argv[4]);
    s.step = (int32_t)(s.emg.rate / atof(argv[5]) + 0.5);
    s.seed = 1;
    s.pace = lsl_pace_map(argv[1], argv[2], 0);
    if (open_streams(&s, argv[2], argc > 7 ? argv[6] : NULL, argc > 7 ? argv[7] : NULL)) {
        play(&s);
    }
    return 1;
}
