/* SPDX-License-Identifier: Apache-2.0 */
/* clocks.h: stamps of senders on this machine's time. */
#ifndef MHI_CLOCKS_H
#define MHI_CLOCKS_H

#include "live/inlet.h"

/* A sender's clock, of a stream. */
typedef struct mhi_clock {
    double guess;    /* s: least (received - stamp), where no offset is known; inf: none yet */
    double shift;    /* s to add, since the clock was set while it ran */
    double received; /* s, of the last packet; NaN: there was none */
    double time;     /* s on this machine, of its last sample, without the shift */
    int32_t n_set;   /* packets in a row in which it was set */
    int32_t unused;  /* its stamps say nothing */
} mhi_clock;

void mhi_clock_start(mhi_clock *clock);

/* The packet in work. */
typedef struct mhi_clock_packet {
    const mhi_packet *packet;
    double offset; /* s to add to its stamps */
    double passed; /* s since the packet before; NaN: it is the first */
    double period; /* s between samples; 0: irregular */
    double from;   /* s, last sample of the packet before */
    int32_t set;   /* the clock was set within it */
} mhi_clock_packet;

void mhi_clock_begin(mhi_clock *clock, const mhi_packet *packet, double rate,
                     mhi_clock_packet *work);
/* Of sample k, in their order: s of CLOCK_MONOTONIC. `*set`: s by which the clock was set before
 * it, 0: it was not, or not for the first time in this packet; the shift is then the caller's to
 * agree with other streams. */
double mhi_clock_time(mhi_clock *clock, mhi_clock_packet *work, int32_t k, double *set);
/* 1: from now on the stamps are not used: the clock was set in every packet. */
int32_t mhi_clock_end(mhi_clock *clock, const mhi_clock_packet *work);

#endif
