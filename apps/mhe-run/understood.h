/* SPDX-License-Identifier: Apache-2.0 */
/* understood.h: what mhe-run --check made of a config, its model and its files. */
#ifndef UNDERSTOOD_H
#define UNDERSTOOD_H

#include "base/text.h"

#include <mhe/estimator.h>
#include <mhe/recording.h>

/* Plain lines: coordinates, muscles, rates, spans and overlap of the sources, what of the model is
 * measured. */
void understood_lines(const mhe_estimator_info *info, const mhe_recording_info *measured,
                      const mhe_recording *recording, mhi_text *out);

#endif
