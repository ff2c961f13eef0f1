/* SPDX-License-Identifier: Apache-2.0 */
/* identity.h: whose results a folder holds: dir/study.id. */
#ifndef IDENTITY_H
#define IDENTITY_H

#include "study.h"

/* Lines of the file: of the program and its plugins, of the study (all but its report section,
 * with the configs and models of all conditions), and, where `motions` is 1, of what the
 * conditions' motions hold. */
mhe_status identity_text(const study *s, int32_t motions, mhi_text *out, mhe_error *err);

/* dir/study.id begins with the text, or is absent (*known = 0). MHE_E_INPUT: it is of another
 * study, version or build. */
mhe_status identity_check(const char *dir, const mhi_text *text, int32_t *known, mhe_error *err);

/* Writes study.id, and for people and the report study.yaml, study.json and config.yaml (of the
 * first condition). */
mhe_status identity_write(const study *s, const char *dir, const mhi_text *text, mhe_error *err);

#endif
