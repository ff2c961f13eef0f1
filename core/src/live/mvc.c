/* SPDX-License-Identifier: Apache-2.0 */
/* mvc.c: maximal voluntary contractions: the largest envelope of an electrode while it is asked
 * for. The run takes it at once. */
#include "base/clock.h"
#include "base/text.h"
#include "live/live_private.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

mhi_inlet *mhi_live_electrodes(mhe_live *l) {
    for (int32_t i = 0; i < l->feed.n_inlets; i++) {
        if (l->feed.inlets[i].is_raw && l->feed.inlets[i].channel >= 0) {
            return &l->feed.inlets[i];
        }
    }
    return NULL;
}

void mhi_live_begin_mvc(mhe_live *l, const char *name) {
    mhi_inlet *in = mhi_live_electrodes(l);
    double before = 0;
    l->mvc_channel = -1;
    for (int32_t i = 0; in != NULL && i < l->run->emg.n_channels && i < MHI_FEED_MAXIMA; i++) {
        if (strcmp(l->run->emg.channels[i].name, name) == 0 &&
            mhi_electrodes_peak(in->electrodes, i, 1, &before)) {
            l->mvc_channel = i;
            l->mvc_began = mhi_seconds();
        }
    }
}

/* All maxima found so far, as the config's section takes them. */
static void write_mvc(mhe_live *l) {
    mhi_text text = {0};
    char path[1100];
    mhi_text_add(&text,
                 "# Envelopes at maximal contraction, in the channels' units: write them into "
                 "emg.channels as mvc.\n");
    for (int32_t i = 0; i < l->run->emg.n_channels && i < MHI_FEED_MAXIMA; i++) {
        if (l->feed.maxima[i] > 0) {
            mhi_text_add(&text, "- {name: \"%s\", mvc: %.6g}\n", l->run->emg.channels[i].name,
                         l->feed.maxima[i]);
        }
    }
    (void)snprintf(path, sizeof path, "%.1000s/mvc.yaml", l->folder);
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    const int whole =
        file >= 0 && !text.failed && write(file, text.data, text.length) == (ssize_t)text.length;
    if (file >= 0) {
        (void)close(file);
    }
    if (whole) {
        (void)snprintf(l->mvc_file, sizeof l->mvc_file, "%.500s", path);
    } else {
        char line[1200];
        (void)snprintf(line, sizeof line, "%s: cannot be written: %s", path, strerror(errno));
        l->host->log(l->host, MHE_LOG_ERROR, line);
    }
    mhi_text_free(&text);
}

void mhi_live_take_mvc(mhe_live *l, int32_t channel, double value) {
    char line[256];
    mhe_error err = {0};
    if (!mhi_feed_set_maximum(&l->feed, channel, value)) {
        return;
    }
    (void)snprintf(line, sizeof line,
                   "electrode '%.100s': its EMG is relative to %.6g from here on",
                   l->run->emg.channels[channel].name, value);
    l->host->log(l->host, MHE_LOG_INFO, line);
    if (l->record != NULL && mhi_taping_maximum(l->record, channel, value, &err) != MHE_OK) {
        mhi_live_end_record(l, err.text);
    }
}

void mhi_live_end_mvc(mhe_live *l) {
    mhi_inlet *in = mhi_live_electrodes(l);
    double peak = 0;
    if (l->mvc_channel >= 0 && in != NULL &&
        mhi_electrodes_peak(in->electrodes, l->mvc_channel, 0, &peak) && peak > 0) {
        mhi_live_take_mvc(l, l->mvc_channel, peak);
        write_mvc(l);
    }
    l->mvc_channel = -1;
}
