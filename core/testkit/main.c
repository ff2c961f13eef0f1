/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-conformance: runs the conformance checks on plugin files.
 * Exit status: 0 all passed, 1 a check failed, 2 wrong command line, 77 some plugin could not be
 * evaluated. */
#include <mhe/testkit.h>

#include <stdio.h>
#include <string.h>

#ifdef MHE_COUNT_ALLOCATIONS
#include "allocations.h"

static uint64_t allocations(void *data) {
    (void)data;
    return mhi_allocations();
}
#endif

static void print(void *data, int32_t outcome, const char *plugin, const char *check,
                  const char *detail) {
    static const char *const words[] = {"ok  ", "FAIL", "skip", "note"};
    const int *verbose = data;
    if (*verbose || outcome != MHE_CHECK_PASSED) {
        printf("%s  %s%s%s%s%s\n", words[outcome], plugin, plugin[0] != '\0' ? ": " : "", check,
               detail[0] != '\0' ? ": " : "", detail);
    }
}

int main(int argc, char **argv) {
    int verbose = 0, n_files = 0;
    mhe_testkit kit = {.size = sizeof kit, .data = &verbose, .report = print};
#ifdef MHE_COUNT_ALLOCATIONS
    kit.allocations = allocations;
#endif
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--verbose") == 0) {
            verbose = 1;
        } else if (argv[i][0] == '-') {
            n_files = 0;
            break;
        } else {
            n_files++;
        }
    }
    if (n_files == 0) {
        fprintf(stderr, "usage: mhe-conformance [--verbose] PLUGIN.so ...\n");
        return 2;
    }
    for (int i = 1; i < argc; i++) {
        if (argv[i][0] != '-') {
            (void)mhe_testkit_run(&kit, argv[i], NULL); /* a refusal is a failed check */
        }
    }
    printf("%d passed, %d failed, %d skipped\n", (int)kit.passed, (int)kit.failed,
           (int)kit.skipped);
    return kit.failed > 0 ? 1 : (kit.skipped > 0 ? 77 : 0);
}
