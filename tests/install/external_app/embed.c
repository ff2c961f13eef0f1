/* SPDX-License-Identifier: Apache-2.0 */
/* embed: an application of somebody else, linked with the installed core. Opens an estimator for
 * the config that it is given and prints its sizes. */
#include <mhe/estimator.h>
#include <mhe/version.h>

int main(int argc, char **argv) {
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    if (argc != 2) {
        fprintf(stderr, "usage: embed CONFIG.yaml\n");
        return 2;
    }
    if (mhe_estimator_open(argv[1], NULL, 0, NULL, &estimator, &err) != MHE_OK) {
        fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    mhe_estimator_info info = {.size = sizeof info};
    mhe_estimator_describe(estimator, &info);
    printf("mhe %s: %d coordinates, %d muscles\n", MHE_VERSION, info.n_q, info.n_muscles);
    mhe_estimator_close(estimator);
    return 0;
}
