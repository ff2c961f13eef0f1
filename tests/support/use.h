/* SPDX-License-Identifier: Apache-2.0 */
/* use.h: plugins in tests, through the registry and the option tables as the core uses them. */
#ifndef TEST_USE_H
#define TEST_USE_H

#include "support.h"

#include <mhe/plugin.h>

/* A host that shows nothing. */
const mhe_host *test_host(void);

/* The plugin with this id in the build tree; NULL where it was not built. Fails the test if
 * refused. */
const mhe_plugin *test_plugin(const char *id, const char *iface);

/* Its config filled from YAML ("stages: 2", "" for the defaults); lives until exit. Fails the test
 * where the text does not fit the option table. */
const void *test_config(const mhe_plugin *plugin, const char *yaml);

#endif
