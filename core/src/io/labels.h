/* SPDX-License-Identifier: Apache-2.0 */
/* labels.h: names of columns, all different. */
#ifndef MHI_LABELS_H
#define MHI_LABELS_H

#include <mhe/abi.h>

/* Replaces *label by `text`, `between` and a number. MHE_E_MEMORY. */
mhe_status mhi_label_number(char **label, const char *text, const char *between, int32_t number,
                            mhe_error *err);
/* Of equal labels [n] the later ones get "__<number>" behind them, counted from 1. *n_equal counts
 * them, *first is the place of the first one. MHE_E_MEMORY. [cold] */
mhe_status mhi_labels_tell_apart(char **labels, int32_t n, int32_t *n_equal, int32_t *first,
                                 mhe_error *err);

#endif
