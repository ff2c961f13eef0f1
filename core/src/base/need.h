/* SPDX-License-Identifier: Apache-2.0 */
/* need.h: what a public function asks of its arguments before it touches them. */
#ifndef MHI_NEED_H
#define MHI_NEED_H

#include <mhe/abi.h>

typedef struct mhi_needed {
    const char *name;
    const void *pointer;
} mhi_needed;

/* MHE_E_ARGUMENT where one of list [n] is NULL: "function: 'name' is NULL". */
mhe_status mhi_need(const char *function, const mhi_needed *list, size_t n, mhe_error *err);

/* MHI_NEED(err, {"path", path}, {"config", config}) */
#define MHI_NEED(err, ...)                                \
    mhi_need(__func__, (const mhi_needed[]){__VA_ARGS__}, \
             sizeof((const mhi_needed[]){__VA_ARGS__}) / sizeof(mhi_needed), (err))

/* Copies a struct of the library's into one of the caller's, both beginning with their own size in
 * bytes: never more than the caller has room for, and that size stays. MHE_E_ARGUMENT: `to` is too
 * small to hold even its size. */
mhe_status mhi_give(const char *function, void *to, const void *from, mhe_error *err);

/* The other way: a struct of the caller's into one of the library's [own bytes]; fields that an
 * older caller does not have are 0, those that only a newer one has are passed over. */
mhe_status mhi_take(const char *function, void *to, uint32_t own, const void *from, mhe_error *err);

#endif
