/* SPDX-License-Identifier: Apache-2.0 */
/* embed: an application of somebody else, linked with the installed core. Opens an estimator for
 * the config that it is given and prints its sizes. */
#include <mhe/estimator.h>
#include <mhe/version.h>
#include <string.h>

int main(int argc, char **argv) {
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    const int has_set = argc == 3 && strncmp(argv[2], "--set=", 6) == 0;
    if (argc != 2 && !has_set) {
        fprintf(stderr, "usage: embed CONFIG.yaml [--set=KEY=VALUE]\n");
        return 2;
    }
    const char *set[] = {has_set ? argv[2] + 6 : ""};
    if (mhe_estimator_open(argv[1], set, has_set, NULL, &estimator, &err) != MHE_OK) {
        fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    mhe_estimator_info info = {.size = sizeof info};
    mhe_estimator_describe(estimator, &info);
    printf("mhe %s: %d coordinates, %d muscles\n", MHE_VERSION, info.n_q, info.n_muscles);
    mhe_estimator_close(estimator);
    return 0;
}
