/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_parameters.h: bytes and parameters of a .c3d file; private to the reader. */
#ifndef MHI_C3D_PARAMETERS_H
#define MHI_C3D_PARAMETERS_H

#include <mhe/abi.h>

#define MHI_C3D_BLOCK 512
#define MHI_C3D_INTEL 84
#define MHI_C3D_DEC 85
#define MHI_C3D_MIPS 86

typedef struct mhi_c3d_file {
    const char *name;
    const uint8_t *data;
    size_t length;
    int32_t processor;         /* MHI_C3D_INTEL ... */
    size_t parameters, beyond; /* bytes from .. to before */
    mhe_error *err;
} mhi_c3d_file;

/* A parameter's values within the file: first dimension fastest. */
typedef struct mhi_c3d_parameter {
    int32_t type;  /* -1 char, 1 byte, 2 integer, 4 float; 0: there is none */
    int32_t width; /* of a text: first dimension */
    int32_t n;     /* numbers, or texts */
    const uint8_t *data;
} mhi_c3d_parameter;

/* Numbers in the file's byte order; the caller has checked the place. */
int32_t mhi_c3d_int16(const mhi_c3d_file *file, const uint8_t *at);
int32_t mhi_c3d_uint16(const mhi_c3d_file *file, const uint8_t *at);
double mhi_c3d_float(const mhi_c3d_file *file, const uint8_t *at);

/* Checks the first bytes and finds the parameters. MHE_E_INPUT. */
mhe_status mhi_c3d_open(mhi_c3d_file *file);
/* The parameter group:name, letter case free; type 0 where there is none (an unsound one counts
 * as none). */
mhi_c3d_parameter mhi_c3d_find(const mhi_c3d_file *file, const char *group, const char *name);
/* Number i, `fallback` where there is none. `unsigned_` reads integers as 0 .. 65535. */
double mhi_c3d_number(const mhi_c3d_file *file, const mhi_c3d_parameter *p, int32_t i,
                      int32_t unsigned_, double fallback);
/* Text i without the blanks around it, as a copy; "" where there is none; NULL: memory is out. */
char *mhi_c3d_text(const mhi_c3d_parameter *p, int32_t i);
/* Parameters of more than 255 entries go on in NAME2, NAME3, ...: the next part, *part being 0 at
 * first; n = 0 behind the last. */
mhi_c3d_parameter mhi_c3d_part(const mhi_c3d_file *file, const char *group, const char *name,
                               int32_t *part);
/* Labels [n] of a group, to be freed one by one whatever is returned; where there is none
 * "<substitute>_<number>"; of equal ones (*n_equal more) the later get "__<number>" behind them.
 * MHE_E_MEMORY. */
mhe_status mhi_c3d_labels(const mhi_c3d_file *file, const char *group, const char *substitute,
                          char **labels, int32_t n, int32_t *n_equal);

#endif
