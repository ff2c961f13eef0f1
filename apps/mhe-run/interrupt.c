/* SPDX-License-Identifier: Apache-2.0 */
#include "interrupt.h"

#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* ns. A signal this soon after another is the same one: `timeout` and some shells send it to the
 * process and to its group, in one go. */
#define ECHO 300000000LL

static const int signals[] = {SIGINT, SIGTERM, SIGALRM};
#define N_SIGNALS ((int)(sizeof signals / sizeof signals[0]))

static atomic_int asked, asked_at_last;
static atomic_llong heard; /* the last that was no echo, ns of CLOCK_MONOTONIC */
static const mhe_outbox *outbox;
static mhe_estimator *estimator;
static struct sigaction before[N_SIGNALS];

/* Only what a signal handler may call. */
static void leave(void) {
    static const char text[] = "mhe-run: interrupted in a solve that does not end; nothing is "
                               "written\n";
    mhe_outbox_abandon(outbox);
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    _exit(1);
}

static int is_echo(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    const long long ns = now.tv_sec * 1000000000LL + now.tv_nsec;
    if (asked && ns - heard < ECHO) {
        return 1;
    }
    heard = ns;
    return 0;
}

static void on_signal(int number) {
    if (number == SIGALRM) {
        leave();
    }
    if (is_echo()) {
        return;
    }
    if (asked) {
        leave();
    }
    asked = 1;
    mhe_estimator_stop(estimator, 1);
    (void)alarm(INTERRUPT_GRACE);
}

static void on_last_signal(int number) {
    if (is_echo()) {
        return;
    }
    if (asked_at_last) { /* takes its usual effect once this handler has returned */
        (void)signal(number, SIG_DFL);
        (void)raise(number);
    }
    asked = asked_at_last = 1;
}

static void handle(void (*handler)(int), struct sigaction *old) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = handler;
    for (int i = 0; i < N_SIGNALS; i++) { /* one at a time: the handler is not interrupted */
        (void)sigaddset(&action.sa_mask, signals[i]);
    }
    for (int i = 0; i < N_SIGNALS; i++) {
        (void)sigaction(signals[i], &action, old == NULL ? NULL : &old[i]);
    }
}

void interrupt_begin(const mhe_outbox *files, mhe_estimator *solving) {
    outbox = files;
    estimator = solving;
    handle(on_signal, before);
}

int32_t interrupt_asked(void) {
    return asked;
}

void interrupt_settle(void) {
    handle(on_last_signal, NULL);
    (void)alarm(0);
}

void interrupt_end(void) {
    for (int i = 0; i < N_SIGNALS && !asked; i++) { /* else the program ends; echoes may be late */
        (void)sigaction(signals[i], &before[i], NULL);
    }
}
