/* SPDX-License-Identifier: Apache-2.0 */
/* describe_options.h: an option table as text, as a markdown table, as JSON. */
#ifndef MHI_DESCRIBE_OPTIONS_H
#define MHI_DESCRIBE_OPTIONS_H

#include "base/text.h"

#include <cjson/cJSON.h>
#include <mhe/option.h>

void mhi_options_text(const mhe_option *options, int32_t n, mhi_text *out);
void mhi_options_markdown(const mhe_option *options, int32_t n, mhi_text *out);
cJSON *mhi_options_json(const mhe_option *options, int32_t n);
void mhi_print_json(cJSON *root, mhi_text *out); /* prints and frees */

#endif
