/* SPDX-License-Identifier: Apache-2.0 */
/* outside.h: what tests of the public headers share. */
#ifndef OUTSIDE_H
#define OUTSIDE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
/* cmocka wants the four above first */
#include <cmocka.h>
#include <mhe/config.h>
#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>

#define ARM19 MHE_TEST_SOURCE_DIR "/models/arm19"

/* In place of an assertion that would hide the message. */
static inline void expect_done(mhe_status status, const mhe_error *err) {
    if (status != MHE_OK) {
        fail_msg("%s: %s", mhe_status_text(status), err->text);
    }
}

static inline mhe_config *read_demo(const char *set) {
    mhe_config *config = NULL;
    mhe_error err = {0};
    expect_done(mhe_config_read(ARM19 "/demo.yaml", &set, set != NULL, 0, NULL, &config, &err),
                &err);
    return config;
}

static inline void assert_value(mhe_config *config, const char *key, const char *expected) {
    char *text = NULL;
    mhe_error err = {0};
    expect_done(mhe_config_get(config, key, &text, &err), &err);
    assert_string_equal(text, expected);
    mhe_free(text);
}

#endif
