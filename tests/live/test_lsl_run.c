/* SPDX-License-Identifier: Apache-2.0 */
/* Live runs against liblsl itself: a sender in a process of its own, the run, and a receiver of
 * what sink_lsl sends. EMG at 2000 Hz comes in packets of 27 samples, up to 40 ms late; the sender
 * has a clock 1000 s off; it is killed and comes again, as it was, with another label, at another
 * rate. The sender waits for the run (lsl_pace.h), so that nothing here depends on speed. */
#include "live_rig.h"
#include "lsl_pace.h"
#include "lsl_rig.h"

#include <math.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#define PATIENCE 60.0
#define MOST 4096 /* samples that are kept */
#define WIDTH 64

static lsl_rig rig;
static lsl_pacer pacer;

/* ---- the sender ---- */

static pid_t start_sender(const char *const *arguments) {
    const pid_t child = fork();
    if (child == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL); /* whatever becomes of the test */
        (void)execvp(arguments[0], (char *const *)(uintptr_t)arguments);
        _exit(127);
    }
    return child;
}

static void kill_sender(pid_t child) {
    if (child > 0) {
        (void)kill(child, SIGKILL);
        (void)waitpid(child, NULL, 0);
    }
}

/* A sender that waits for the run: its pace is there before it looks for it. */
static pid_t paced_sender(const char *const *arguments, const char *name) {
    lsl_pace *pace = lsl_pace_map(live_rig_folder(), name, 1);
    const pid_t child = pace == NULL ? -1 : start_sender(arguments);
    lsl_pace_unmap(pace);
    return child;
}

static pid_t plain_sender(const char *name, const char *rate, const char *label,
                          const char *other) {
    const char *const arguments[] = {MHE_TEST_BINARY_DIR "/tests/lsl_sender",
                                     live_rig_folder(),
                                     name,
                                     "27",
                                     "0.04",
                                     rate,
                                     label,
                                     other,
                                     NULL};
    return paced_sender(arguments, name);
}

/* ---- the receiver: what sink_lsl sends ---- */

typedef struct receiver {
    lsl_inlet inlet;
    int32_t n_channels;
    atomic_int n; /* samples so far */
    double values[MOST][WIDTH], stamps[MOST];
    char labels[WIDTH][64];
} receiver;

static int open_receiver(receiver *r, const char *name) {
    char predicate[128];
    lsl_streaminfo info = NULL;
    int32_t code = 0;
    (void)snprintf(predicate, sizeof predicate, "name='%s'", name);
    lsl_continuous_resolver search = rig.lsl.create_continuous_resolver_bypred(predicate, 5);
    const double until = lsl_rig_now() + PATIENCE;
    while (rig.lsl.resolver_results(search, &info, 1) < 1 && lsl_rig_now() < until) {
        lsl_rig_rest(0.01);
    }
    rig.lsl.destroy_continuous_resolver(search);
    r->inlet = info == NULL ? NULL : rig.lsl.create_inlet(info, 60, 0, 0);
    lsl_streaminfo whole =
        r->inlet == NULL ? NULL : rig.lsl.get_fullinfo(r->inlet, PATIENCE, &code);
    if (whole == NULL) {
        return 0;
    }
    r->n_channels = rig.lsl.get_channel_count(whole);
    lsl_xml_ptr channel =
        rig.lsl.child(rig.lsl.child(rig.lsl.get_desc(whole), "channels"), "channel");
    for (int32_t i = 0; i < r->n_channels && i < WIDTH; i++) {
        (void)snprintf(r->labels[i], sizeof r->labels[i], "%s",
                       rig.lsl.child_value_n(channel, "label"));
        channel = rig.lsl.next_sibling_n(channel, "channel");
    }
    rig.lsl.destroy_streaminfo(whole);
    rig.lsl.destroy_streaminfo(info);
    rig.lsl.open_stream(r->inlet, PATIENCE, &code);
    return code == lsl_no_error && r->n_channels <= WIDTH;
}

/* Takes what comes until there are `enough`, nothing comes for `seconds`, or the sender ends. */
static void receive(receiver *r, double seconds, int32_t enough) {
    int32_t code = 0;
    double stamp, last = lsl_rig_now();
    double row[WIDTH];
    while (lsl_rig_now() - last < seconds && code == lsl_no_error && atomic_load(&r->n) < enough) {
        const unsigned long n = rig.lsl.pull_chunk_d(r->inlet, row, &stamp,
                                                     (unsigned long)r->n_channels, 1, 0.05, &code);
        code = code == lsl_timeout_error ? lsl_no_error : code;
        const int at = atomic_load(&r->n);
        if (n > 0 && at < MOST) {
            memcpy(r->values[at], row, sizeof row);
            r->stamps[at] = stamp;
            atomic_store(&r->n, at + 1);
            last = lsl_rig_now();
        }
    }
}

/* ---- the run ---- */

#define CONFIG                                                                             \
    LIVE_RIG_ARM                                                                           \
    LIVE_RIG_EMG                                                                           \
    "    - {name: DeltAnt, muscles: [Deltoid1], mvc: 0.00049}\n"                           \
    "    - {name: DeltMed, muscles: [Deltoid2], mvc: 0.00043}\n"                           \
    "    - {name: DeltPost, muscles: [Deltoid3], mvc: 0.00102}\n"                          \
    "    - {name: InfraSp, muscles: [InfraSpin], mvc: 0.00035}\n"                          \
    "    - {name: Triceps, muscles: [TricepsLong, TricepsLat, TricepsMed], mvc: 0.0011}\n" \
    "    - {name: Biceps, muscles: [BicepsLong, BicepsShort], mvc: 0.00129}\n"             \
    "    - {name: Brach, muscles: [BRA], mvc: 0.0006}\n"                                   \
    "    - {name: BrachRad, muscles: [BRD], mvc: 0.0005}\n"                                \
    "horizon: {window: 12, ratio: 1}\n"                                                    \
    "costs:\n"                                                                             \
    "  - plugin: mhe.cost.emg-markers-high\n"                                              \
    "    tracked: [Deltoid1, Deltoid2, Deltoid3, InfraSpin, TricepsLong, TricepsLat,\n"    \
    "      TricepsMed, BicepsLong, BicepsShort, BRA, BRD]\n"                               \
    "sinks:\n"                                                                             \
    "  - {plugin: mhe.sink.files, digits: 17, signals: [q, force, emg]}\n"                 \
    "  - {plugin: mhe.sink.lsl, name: %s-out, signals: [q, force]}\n"                      \
    "sources:\n"                                                                           \
    "  - {plugin: mhe.source.lsl, markers: [\"name='%s-markers'\"], emg: [\"name='%s-emg'\"]}\n"

static live_rig run;
static receiver heard;

static const char *config_of(const char *name) {
    static char text[8192];
    (void)snprintf(text, sizeof text, CONFIG, name, name, name);
    return text;
}

/* liblsl takes the delay of a clock's measurement to be the same both ways: on a starved machine
 * the two streams may be tens of milliseconds apart. Hence the window of 12. */
static void begin_run(const char *name, double seconds, void *(*director)(void *)) {
    memset(&heard, 0, sizeof heard);
    run = (live_rig){.name = name,
                     .config = config_of(name),
                     .seconds = seconds,
                     .director = director,
                     .data = (void *)(uintptr_t)name};
}

/* The receiver is there before the first sample leaves. */
static int begin_sending(const char *name) {
    char out[100];
    (void)snprintf(out, sizeof out, "%s-out", name);
    const int ready = lsl_pacer_start(&pacer, live_rig_folder(), name, run.live) &&
                      open_receiver(&heard, out) &&
                      live_words_wait(&run.words, "frames come from", 1);
    if (ready) {
        lsl_pacer_go(&pacer);
    }
    return ready;
}

/* Estimates that were made; the run is over. */
static int32_t count_estimates(void) {
    char *json = NULL;
    const int known = mhe_live_summary(run.live, &json, NULL) == MHE_OK;
    const int32_t n = known ? (int32_t)live_rig_number(json, "estimates") : 0;
    mhe_free(json);
    return n;
}

static void *only_receive(void *data) {
    if (begin_sending(data)) {
        while (!atomic_load(&run.over)) {
            receive(&heard, 0.5, MOST);
        }
        receive(&heard, PATIENCE, count_estimates());
    } else {
        mhe_live_stop(run.live);
    }
    lsl_pacer_stop(&pacer);
    return NULL;
}

/* The rows that were received are those of the files, bit for bit. */
static void check_heard(const char *name) {
    int32_t n_rows, n_q, n_forces, n_emg;
    double *q = live_rig_table(name, "live_q.sto", &n_rows, &n_q);
    double *force = live_rig_table(name, "live_force.sto", &n_rows, &n_forces);
    double *emg = live_rig_table(name, "live_emg.sto", &n_rows, &n_emg);
    assert_non_null(q);
    assert_non_null(force);
    assert_non_null(emg);
    assert_int_equal(heard.n_channels, n_q + n_forces + 3); /* status, latency, lost */
    assert_string_equal(heard.labels[n_q], "force.Pectoral2");
    assert_true(n_rows > 100);
    assert_int_equal(atomic_load(&heard.n), n_rows);
    for (int32_t k = 0; k < n_rows; k++) {
        assert_memory_equal(heard.values[k], q + k * n_q, sizeof *q * (size_t)n_q);
        assert_memory_equal(heard.values[k] + n_q, force + k * n_forces,
                            sizeof *q * (size_t)n_forces);
        assert_true(heard.values[k][heard.n_channels - 1] == 0);
    }
    free(q);
    free(force);
    free(emg);
}

static void check_run(mhe_status status) {
    if (status != MHE_OK) {
        fail_msg("%s\n%s", run.err.text, run.words.text);
    }
}

/* Every node has its EMG. With late samples dropped most would have none. */
static void check_nodes(void) {
    assert_int_equal(live_rig_number(run.summary, "nodes_without"), 0);
    assert_true(live_rig_number(run.summary, "late_nodes") > 0); /* they do come late */
}

static void emg_in_late_packets(void **state) {
    (void)state;
    pid_t sender = plain_sender("late", "2000", NULL, NULL);
    begin_run("late", 2.5, only_receive);
    const mhe_status status = live_rig_run(&run);
    kill_sender(sender);
    check_run(status);
    assert_true(live_rig_number(run.summary, "frames") >= 240);
    assert_true(live_rig_number(run.summary, "nodes") >= 230);
    check_nodes();
    check_heard("late");
    mhe_free(run.summary);
}

static int has_time_namespaces(void) {
    return system("unshare --time --monotonic 1000 --fork true >/dev/null 2>&1") == 0;
}

static void a_clock_far_off(void **state) {
    (void)state;
    if (!has_time_namespaces()) {
        print_message("skipped: unshare --time is not allowed here\n");
        skip();
    }
    const char *const arguments[] = {"unshare",
                                     "--time",
                                     "--monotonic",
                                     "1000",
                                     "--fork",
                                     "--kill-child",
                                     MHE_TEST_BINARY_DIR "/tests/lsl_sender",
                                     live_rig_folder(),
                                     "off",
                                     "27",
                                     "0.04",
                                     "2000",
                                     NULL};
    pid_t sender = paced_sender(arguments, "off");
    begin_run("off", 1.5, only_receive);
    const double before = lsl_rig_now();
    const mhe_status status = live_rig_run(&run);
    const double after = lsl_rig_now();
    kill_sender(sender);
    check_run(status);
    assert_true(live_rig_number(run.summary, "frames") >= 140);
    check_nodes();
    check_heard("off");
    const double clock = lsl_rig_now() - rig.lsl.local_clock();
    for (int32_t k = 0; k < atomic_load(&heard.n); k++) { /* stamps of this machine's time */
        assert_true(heard.stamps[k] + clock > before - 0.1 && heard.stamps[k] + clock < after);
    }
    mhe_free(run.summary);
}

/* ---- killed, and another one comes ---- */

static pid_t guest;

/* Takes what comes until there are `more` estimates than now. */
static int hear(int32_t more) {
    const int32_t enough = atomic_load(&heard.n) + more;
    receive(&heard, PATIENCE, enough);
    return atomic_load(&heard.n) >= enough;
}

static int32_t reached;

static const char *const back[] = {"'guest-markers' is back", "'guest-emg' is back"};

static int wait_lost(void) {
    const double until = lsl_rig_now() + PATIENCE;
    while (!lsl_pacer_lost(&pacer) && lsl_rig_now() < until) {
        lsl_rig_rest(0.005);
    }
    return lsl_pacer_lost(&pacer);
}

/* Both streams are lost, another sender comes, and both are back, of which `said` tells more. */
static int replace_guest(const char *rate, const char *label, const char *other, const char *said) {
    kill_sender(guest);
    lsl_pacer_hold(&pacer);
    if (!wait_lost()) {
        return 0;
    }
    const int32_t before[] = {live_words_count(&run.words, back[0]),
                              live_words_count(&run.words, back[1]),
                              live_words_count(&run.words, said)};
    receive(&heard, 0.2, MOST); /* what was under way */
    guest = plain_sender("guest", rate, label, other);
    if (!live_words_wait(&run.words, back[0], before[0] + 1) ||
        !live_words_wait(&run.words, back[1], before[1] + 1) ||
        !live_words_wait(&run.words, said, before[2] + 1)) {
        return 0;
    }
    lsl_pacer_go(&pacer);
    return hear(30);
}

static void *direct(void *data) {
    reached = 0;
    if (begin_sending(data) && hear(30)) {
        reached = 1;
        reached += replace_guest("2000", NULL, NULL, "'guest-emg' is back");
        reached +=
            replace_guest("2000", "STYLr", "Elsewhere", "'guest-markers' is back with other");
        reached += replace_guest("1000", NULL, NULL, "'guest-emg' is back with other");
    }
    mhe_live_stop(run.live);
    lsl_pacer_stop(&pacer);
    return NULL;
}

static void killed_and_started_again(void **state) {
    (void)state;
    guest = plain_sender("guest", "2000", NULL, NULL);
    begin_run("guest", 0, direct);
    const mhe_status status = live_rig_run(&run);
    kill_sender(guest);
    check_run(status);
    if (reached != 4) {
        fail_msg("only %d of 4 were reached:\n%s\n%s", (int)reached, run.words.text, run.summary);
    }
    /* the other label was told by name while it was there: as missing, and as of nothing */
    assert_true(live_words_count(&run.words, "STYLr") >= 1);
    assert_true(live_words_count(&run.words, "Elsewhere") >= 1);
    mhe_free(run.summary);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(emg_in_late_packets),
                                       cmocka_unit_test(a_clock_far_off),
                                       cmocka_unit_test(killed_and_started_again)};
    if (!lsl_rig_open(live_rig_folder(), &rig)) {
        (void)puts("skipped: there is no liblsl (vendor/take fetches it)");
        return TEST_SKIPPED;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
