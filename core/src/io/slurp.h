/* SPDX-License-Identifier: Apache-2.0 */
/* slurp.h: a whole input file in memory, or what tells its content from another's. */
#ifndef MHI_SLURP_H
#define MHI_SLURP_H

#include <mhe/abi.h>

/* Largest input file taken: far above a day of motion, far below what would exhaust a machine. */
#define MHI_SLURP_MAX ((size_t)1 << 30)

/* Reads a file or pipe into *text, followed by a NUL that *length does not count; free() it.
 * MHE_E_INPUT: "path: why": absent, unreadable, a folder, too large. [cold] */
mhe_status mhi_slurp(const char *path, char **text, size_t *length, mhe_error *err);

/* Length and digest (base/digest.h) of a file's content. MHE_E_INPUT as above. [cold] */
mhe_status mhi_file_digest(const char *path, size_t *length, uint64_t *digest, mhe_error *err);

#endif
