/* SPDX-License-Identifier: Apache-2.0 */
/* library.h: what libmhe.so says of itself. */
#ifndef MHE_LIBRARY_H
#define MHE_LIBRARY_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* "0.1.0": of the library that runs, where version.h says what was compiled against. [any] */
MHE_API const char *mhe_version(void);

/* What a status means, in a few words; of an unknown one "an unknown status". [any] */
MHE_API const char *mhe_status_text(mhe_status status);

#ifdef __cplusplus
}
#endif
#endif
