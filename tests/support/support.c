/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* nftw, mkdtemp */
#include "support.h"

#include <ftw.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *test_data_path(char *out, size_t size, const char *file) {
    const char *shared = getenv("MHE_SHARED");
    if (shared == NULL) {
        shared = MHE_TEST_SOURCE_DIR "/../shared";
    }
    int n = snprintf(out, size, "%s/data/%s", shared, file);
    return n > 0 && (size_t)n < size && access(out, R_OK) == 0 ? out : NULL;
}

static char root[256]; /* of all folders of this process; empty: none yet */
static pid_t owner;    /* a child that ends leaves it alone */

static int remove_one(const char *path, const struct stat *about, int kind, struct FTW *walk) {
    (void)about, (void)kind, (void)walk;
    return remove(path);
}

static void remove_root(void) {
    if (getpid() == owner) {
        (void)nftw(root, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    }
}

static int make_root(void) {
    const char *below = getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp";
    const int n = snprintf(root, sizeof root, "%s/mhe-test-XXXXXX", below);
    if (n < 0 || (size_t)n >= sizeof root || mkdtemp(root) == NULL) {
        root[0] = '\0';
        return -1;
    }
    owner = getpid();
    (void)atexit(remove_root);
    return 0;
}

const char *test_folder(char *out, size_t size) {
    if (root[0] == '\0' && make_root() != 0) {
        return NULL;
    }
    const int n = snprintf(out, size, "%s/XXXXXX", root);
    return n < 0 || (size_t)n >= size ? NULL : mkdtemp(out);
}

double test_random(uint64_t *seed, double lower, double upper) {
    uint64_t z = (*seed += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return lower + (upper - lower) * ((double)(z >> 11) * 0x1p-53);
}

double test_jacobian_error(test_function f, void *data, const double *x, int n_x, int n_y,
                           const double *jacobian) {
    double *point = malloc(sizeof(double) * (size_t)n_x);
    double *plus = malloc(sizeof(double) * (size_t)n_y);
    double *minus = malloc(sizeof(double) * (size_t)n_y);
    double worst = 0;
    int failed = point == NULL || plus == NULL || minus == NULL;
    for (int j = 0; j < n_x && !failed; j++) {
        double best = INFINITY; /* of the steps, for this column */
        for (double step = 1e-2; step > 1e-9 && !failed; step /= 4) {
            memcpy(point, x, sizeof(double) * (size_t)n_x);
            point[j] = x[j] + step;
            failed |= f(data, point, plus) != 0;
            point[j] = x[j] - step;
            failed |= f(data, point, minus) != 0;
            double error = 0;
            for (int i = 0; i < n_y && !failed; i++) {
                double difference = (plus[i] - minus[i]) / (2 * step);
                double scale = 1e-6;
                for (int k = 0; k < n_x; k++) {
                    scale = fmax(scale, fabs(jacobian[i * n_x + k]));
                }
                double off = fabs(difference - jacobian[i * n_x + j]) / scale;
                error = off > error || isnan(off) ? off : error;
            }
            best = error < best ? error : best;
        }
        worst = best > worst ? best : worst;
    }
    free(point);
    free(plus);
    free(minus);
    return failed ? -1 : worst;
}
