/* SPDX-License-Identifier: Apache-2.0 */
/* parts.h: what markers.c and emg.c share: streams, clocks, lists of names. */
#ifndef MHI_NOISE_PARTS_H
#define MHI_NOISE_PARTS_H

#include "base/arena.h"
#include "noise/noise.h"
#include "noise/random.h"

/* Kinds of streams; a number, once given, is never used for something else. */
#define MHI_STREAM_OFFSET 1    /* channel: marker, index: axis */
#define MHI_STREAM_WHITE 2     /* channel: marker, index: 3 sample + axis */
#define MHI_STREAM_DRIFT 3     /* as WHITE */
#define MHI_STREAM_HARMONIC 4  /* channel: muscle, index: harmonic */
#define MHI_STREAM_GAIN 5      /* channel: muscle, index: 0 */
#define MHI_STREAM_RAW 6       /* channel: electrode, index: sample */
#define MHI_STREAM_AMPLIFIER 7 /* as RAW */

/* ---- clock.c ---- */

/* Times of the clock's samples, and room for n_channels values each, zeroed. `what` names the
 * record in messages. */
mhe_status mhi_record_open(mhi_record *record, const mhi_clock *clock,
                           const mhi_recording *reference, int32_t n_channels, const char *what,
                           mhe_error *err);

/* Where in the reference sample k was taken: row `row`, and a fraction of the way to the next. */
typedef struct mhi_moment {
    int32_t row;
    double fraction; /* [0, 1); 0 at the last row */
    double step;     /* s to the next row */
} mhi_moment;
mhi_moment mhi_clock_moment(const mhi_clock *clock, const mhi_recording *reference, double label);

/* ---- names.c ---- */

typedef struct mhi_span {
    int32_t subject;
    double begin, end; /* s */
} mhi_span;

/* What may be named: `what` is "marker", `names` [n]. */
typedef struct mhi_subjects {
    const char *what;
    const char *const *names;
    int32_t n;
} mhi_subjects;

/* Where a map stands, for messages: section node and key. */
typedef struct mhi_map_place {
    const mhi_tree *tree;
    const mhi_node *section;
    const char *key;
} mhi_map_place;

/* {subject: "1..1.5, 2..2.2"} as spans [*n]. MHE_E_CONFIG. */
mhe_status mhi_spans_read(const mhe_text_map *map, const mhi_map_place *place,
                          const mhi_subjects *subjects, mhi_arena *arena, mhi_span **spans,
                          int32_t *n, mhe_error *err);
/* Sets the values of `width` channels a subject to `value` while their time is in one of its spans.
 */
void mhi_spans_apply(const mhi_span *spans, int32_t n, int32_t width, double value,
                     mhi_record *record);

/* {reader: "source 0.2, another 0.1"} added to matrix [readers x sources]. MHE_E_CONFIG. */
mhe_status mhi_fractions_read(const mhe_text_map *map, const mhi_map_place *place,
                              const mhi_subjects *readers, const mhi_subjects *sources,
                              double *matrix, mhe_error *err);

/* ---- emg.c ---- */

/* MHE_E_INPUT: the reference lacks an excitation. */
mhe_status mhi_noise_check_excitations(const mhi_recording *reference, const mhe_description *model,
                                       mhe_error *err);
/* [n_muscles], of the arena; NULL: memory is out. */
const char **mhi_muscle_names(const mhe_description *model, mhi_arena *arena);

#endif
