/* SPDX-License-Identifier: Apache-2.0 */
/* trust.h: whose code is run. */
#ifndef MHI_TRUST_H
#define MHI_TRUST_H

#include <mhe/abi.h>

/* MHE_E_PLUGIN: everybody may put files into this folder (absolute, without links), or into another
 * one's place on the way to it; or write to this file. Not so in a sticky folder like /tmp, where
 * names belong to their owners. The text is the reason, without the path. */
mhe_status mhi_trust_folder(const char *folder, mhe_error *err);
mhe_status mhi_trust_file(const char *file, mhe_error *err);

#endif
