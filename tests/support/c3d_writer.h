/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_writer.h: .c3d files for the tests, in every byte order. */
#ifndef TEST_C3D_WRITER_H
#define TEST_C3D_WRITER_H

#include <stddef.h>
#include <stdint.h>

typedef struct test_c3d {
    int32_t processor; /* 84 Intel, 85 DEC, 86 MIPS */
    int32_t is_float, is_unsigned;
    int32_t n_points, n_channels, per_frame, n_frames, first;
    double rate, scale;           /* scale above 0 also where is_float */
    const char *unit;             /* of the points; NULL: not said */
    const char *const *labels;    /* [n_points]; NULL: "P1", "P2", ... */
    const char *const *channels;  /* [n_channels]; NULL: "C1", ... */
    double gain, general, offset; /* of all channels; channel c has the scale gain (c + 1) */
    int32_t long_frames;          /* frame numbers beyond the header's in TRIAL */
    /* Position of a point in the file's unit, not finite: a gap; raw sample of a channel. */
    void (*point)(int32_t frame, int32_t point, double xyz[3]);
    double (*sample)(int32_t row, int32_t channel);
} test_c3d;

/* The file in memory of *size bytes, to be freed. */
uint8_t *test_c3d_make(const test_c3d *c3d, size_t *size);
/* Puts it into a file; 0: done. */
int test_c3d_write(const test_c3d *c3d, const char *path);

#endif
