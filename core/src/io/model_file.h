/* SPDX-License-Identifier: Apache-2.0 */
/* model_file.h: reads a model file into a description. */
#ifndef MHI_MODEL_FILE_H
#define MHI_MODEL_FILE_H

#include <mhe/description.h>

/* Reads .osim (OpenSim 2.x to 4.x XML) or .bioMod (biorbd, versions 1 to 4), told apart by content,
 * then by name. The description owns all its memory; give it back with mhi_description_free.
 * Elements that it cannot say are listed in ->unsupported; the caller decides. MHE_E_INPUT:
 * "file:line: what is wrong". [cold] */
mhe_status mhi_model_read(const char *path, mhe_description **description, mhe_error *err);

/* The same with the coordinates that the file locks free, each with its own place among the others:
 * for inverse dynamics that sees their accelerations. [cold] */
mhe_status mhi_model_read_unlocked(const char *path, mhe_description **description, mhe_error *err);

/* Makes a finished description's coordinates i with a finite at[i] [n_coordinates] constants at
 * that value, as locked ones of the file are; the rest keep their order. MHE_E_MEMORY. [cold] */
mhe_status mhi_description_lock(mhe_description *description, const double *at, mhe_error *err);

/* Room for n numbers that lives as long as the description; NULL: no memory. [cold] */
double *mhi_description_take(mhe_description *description, int32_t n);

/* mhi_model_read from memory; `name` is used in messages. [cold] */
mhe_status mhi_model_parse(const char *name, const char *text, size_t length,
                           mhe_description **description, mhe_error *err);
/* Of one format, whose text is UTF-8 without a byte-order mark. */
mhe_status mhi_osim_parse(const char *name, const char *text, size_t length,
                          mhe_description **description, mhe_error *err);
mhe_status mhi_osim_parse_unlocked(const char *name, const char *text, size_t length,
                                   mhe_description **description, mhe_error *err);
mhe_status mhi_biomod_parse(const char *name, const char *text, size_t length,
                            mhe_description **description, mhe_error *err);
void mhi_description_free(mhe_description *description);

#endif
