/* SPDX-License-Identifier: Apache-2.0 */
#include "interrupt.h"

#include <signal.h>
#include <string.h>
#include <unistd.h>

static const int signals[] = {SIGINT, SIGTERM, SIGALRM};
#define N_SIGNALS ((int)(sizeof signals / sizeof signals[0]))

static atomic_int asked;
static const mhi_outbox *outbox;
static struct sigaction before[N_SIGNALS];

/* Only what a signal handler may call. */
static void leave(void) {
    static const char text[] = "mhe-run: interrupted in a solve that does not end; nothing is "
                               "written\n";
    mhi_outbox_abandon(outbox);
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    _exit(1);
}

static void on_signal(int number) {
    if (number == SIGALRM || asked) {
        leave();
    }
    asked = 1;
    (void)alarm(INTERRUPT_GRACE);
}

static void on_last_signal(int number) {
    (void)number;
    asked = 1;
}

static void handle(void (*handler)(int), int flags, struct sigaction *old) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = handler;
    action.sa_flags = flags;
    for (int i = 0; i < N_SIGNALS; i++) { /* one at a time: the handler is not interrupted */
        (void)sigaddset(&action.sa_mask, signals[i]);
    }
    for (int i = 0; i < N_SIGNALS; i++) {
        (void)sigaction(signals[i], &action, old == NULL ? NULL : &old[i]);
    }
}

void interrupt_begin(const mhi_outbox *files) {
    outbox = files;
    handle(on_signal, 0, before);
}

const atomic_int *interrupt_asked(void) {
    return &asked;
}

void interrupt_settle(void) {
    handle(on_last_signal, (int)SA_RESETHAND, NULL);
    (void)alarm(0);
}

void interrupt_end(void) {
    for (int i = 0; i < N_SIGNALS; i++) {
        (void)sigaction(signals[i], &before[i], NULL);
    }
}
