/* SPDX-License-Identifier: Apache-2.0 */
/* person.h: what a calibration leaves behind: the model file with the person's numbers, and a
 * config that uses it. */
#ifndef MHI_CALIBRATE_PERSON_H
#define MHI_CALIBRATE_PERSON_H

#include "calibrate/calibrate.h"

/* The model file as it stands, with the numbers of muscles and markers that were estimated in the
 * place of the old ones. MHE_E_UNSUPPORTED: it is no .osim; MHE_E_INPUT: a number is not found in
 * it. [cold] */
mhe_status mhi_person_model(const mhi_calibration *c, mhi_text *out, mhe_error *err);
/* The config with every key, on the model `file`, with gains and shape factors at the channels.
 * [cold]
 */
mhe_status mhi_person_config(const mhi_calibration *c, const char *file, mhi_text *out,
                             mhe_error *err);

#endif
