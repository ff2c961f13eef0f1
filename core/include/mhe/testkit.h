/* SPDX-License-Identifier: Apache-2.0 */
/* testkit.h: conformance checks that any plugin can be put through (library mhe::testkit).
 *
 * The program `mhe-conformance FILE.so` does it from the command line, and mhe_add_plugin()
 * registers it as a test. Every plugin of the file is loaded as the core loads it, created on a
 * made-up problem with the default values of its options, and held to what its interface's header
 * promises: exact derivatives, inputs left alone, nothing written past an output, the same bits on
 * one thread and on eight, no allocation in [hot] calls. */
#ifndef MHE_TESTKIT_H
#define MHE_TESTKIT_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_CHECK_PASSED 0
#define MHE_CHECK_FAILED 1
#define MHE_CHECK_SKIPPED 2 /* could not be tried; the text says why */
#define MHE_CHECK_NOTE 3    /* nothing wrong, worth knowing */

typedef struct mhe_testkit {
    uint32_t size;
    void *data; /* for the two functions below */
    /* Takes one result: plugin id, check ("jacobian against differences") and detail ("" or one
     * line). Called from the thread that runs the checks. */
    void (*report)(void *data, int32_t outcome, const char *plugin, const char *check,
                   const char *detail);
    /* Number of allocations that the calling thread has made so far; NULL: not counted. */
    uint64_t (*allocations)(void *data);
    /* out: how many checks ended how */
    int32_t passed, failed, skipped;
} mhe_testkit;

/* Runs all checks on the plugins of one shared object. MHE_E_PLUGIN: the file was refused (reported
 * as a failed check too). [cold] */
mhe_status mhe_testkit_run(mhe_testkit *kit, const char *file, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
