/* SPDX-License-Identifier: Apache-2.0 */
/* fixture.h: an estimator on the shipped arm, from the text of a config. */
#ifndef TEST_FIXTURE_H
#define TEST_FIXTURE_H

#include "estimator/create.h"

typedef struct test_fixture {
    char folder[256]; /* temporary; holds config.yaml */
    mhi_registry *registry;
    mhi_run *run;
    mhe_estimator *estimator;
    const mhi_system *system;
    mhi_ocp *ocp;
    mhe_host host;
    int32_t n_warnings; /* lines the host was given */
    char told[4096];    /* these */
    mhe_error err;
} test_fixture;

/* Opens `yaml`, in which $ARM19 and $ARM35 stand for the shipped models; returns the status and
 * fills `err`. */
mhe_status test_fixture_open(test_fixture *fixture, const char *yaml);
void test_fixture_close(test_fixture *fixture);

#endif
