/* SPDX-License-Identifier: Apache-2.0 */
/* config.h: what a public config holds. */
#ifndef MHI_LIBRARY_CONFIG_H
#define MHI_LIBRARY_CONFIG_H

#include "config/run.h"

#include <mhe/config.h>
#include <mhe/description.h>

struct mhe_config {
    const mhe_host *host;
    mhi_registry *registry;
    mhi_run *run;
    mhe_description *model; /* NULL until it is asked for */
    mhi_tree *resolved;     /* of mhe_config_get; NULL until it is asked for */
};

/* The model that the config names, read once. Lent. MHE_E_INPUT, MHE_E_CONFIG. [cold] */
mhe_status mhi_config_model(mhe_config *config, const mhe_description **model, mhe_error *err);

#endif
