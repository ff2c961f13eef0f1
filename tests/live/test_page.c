/* SPDX-License-Identifier: Apache-2.0 */
/* A live run in a browser: headless Chromium opens the page and drives it, the official client of
 * Foxglove reads it, strangers are turned away (page.js); the page's numbers are those of the
 * tables. MHE_PAGE_MESSAGES=2000 looks for 20 s; MHE_KEEP_PICTURES=DIR keeps what it looked like.
 */
#include "live_rig.h"

#include <mhe/library.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#define RECORDING MHE_TEST_SOURCE_DIR "/models/arm19/demo_recording.c3d"
#define CONFIG                                                                                     \
    LIVE_RIG_ARM                                                                                   \
    "emg:\n"                                                                                       \
    "  channels:\n"                                                                                \
    "    - {name: DeltMed, muscles: [Deltoid2], mvc: 0.00043}\n"                                   \
    "    - {name: Biceps, muscles: [BicepsLong, BicepsShort], mvc: 0.00129}\n"                     \
    "horizon: {window: 7, ratio: 1}\n"                                                             \
    "costs: [{plugin: mhe.cost.emg-markers-high, tracked: [Deltoid2, BicepsLong, BicepsShort]}]\n" \
    "sinks:\n"                                                                                     \
    "  - {plugin: mhe.sink.files, digits: 17, signals: [q, force]}\n"                              \
    "  - {plugin: mhe.sink.web, port: %d}\n"                                                       \
    "sources: [{plugin: mhe.source.recording, markers: %s/markers.trc, emg: " RECORDING            \
    ", loop: true}]\n"

static live_rig run;
static int code = -1;
static int32_t port;

static void *browse(void *data) {
    (void)data;
    char token[64] = "", command[800];
    if (live_words_wait(&run.words, "frames come from", 1)) {
        const char *at = strstr(run.words.text, "http://127.0.0.1:");
        if (at != NULL && sscanf(at, "http://127.0.0.1:%d/?token=%63[0-9a-f]", &port, token) == 2) {
            (void)snprintf(command, sizeof command,
                           "command -v node >/dev/null || exit 77; node %s %d %s %s/page",
                           MHE_TEST_SOURCE_DIR "/tests/live/page.js", (int)port, token,
                           live_rig_folder());
            code = system(command);
        }
    }
    mhe_live_stop(run.live);
    return NULL;
}

static void in_the_browser(void **state) {
    (void)state;
    char text[4096], command[600];
    (void)snprintf(command, sizeof command,
                   "sed '4s/STYLr/Elsewhere/' %s/models/arm19/demo_markers.trc > %s/markers.trc",
                   MHE_TEST_SOURCE_DIR, live_rig_folder()); /* put right on the page */
    assert_int_equal(system(command), 0);
    (void)snprintf(text, sizeof text, CONFIG, 0, live_rig_folder());
    run = (live_rig){.name = "page", .config = text, .director = browse};
    const mhe_status status = live_rig_run(&run);
    if (status != MHE_OK) {
        fail_msg("%s", run.err.text);
    }
    mhe_free(run.summary);
    if (WEXITSTATUS(code) == 77) {
        print_message("skipped: chromium, ws or ws-protocol is not installed\n");
        skip();
    }
    assert_int_equal(code, 0);
    (void)snprintf(command, sizeof command, "node %s --check %s/page",
                   MHE_TEST_SOURCE_DIR "/tests/live/page.js", live_rig_folder());
    assert_int_equal(system(command), 0);
    /* what the buttons made: a recording whose name the program made, and the maximum found */
    (void)snprintf(
        command, sizeof command,
        "test -s %s/page/mvc.yaml && grep -q Biceps %s/page/mvc.yaml && test $(ls %s/page/"
        "live-2*.xdf | wc -l) = 1",
        live_rig_folder(), live_rig_folder(), live_rig_folder());
    assert_int_equal(system(command), 0);
    if (getenv("MHE_KEEP_PICTURES") != NULL) {
        (void)snprintf(command, sizeof command, "cp %s/page/*.png \"$MHE_KEEP_PICTURES\"",
                       live_rig_folder());
        assert_int_equal(system(command), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(in_the_browser)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
