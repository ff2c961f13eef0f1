/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void count_line(const mhe_host *host, int32_t level, const char *text) {
    test_fixture *f = host->data;
    (void)level;
    const size_t n = strlen(f->told);
    (void)snprintf(f->told + n, sizeof f->told - n, "%s\n", text);
    f->n_warnings++;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

/* Writes yaml with the models' paths filled in. */
static int write_config(const char *path, const char *yaml) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        return -1;
    }
    for (const char *at = yaml; *at != '\0';) {
        const char *model = strncmp(at, "$ARM19", 6) == 0   ? "arm19"
                            : strncmp(at, "$ARM35", 6) == 0 ? "arm35"
                                                            : NULL;
        if (model == NULL) {
            (void)fputc(*at++, file);
        } else {
            (void)fprintf(file, "%s/models/%s/%s.osim", MHE_TEST_SOURCE_DIR, model, model);
            at += 6;
        }
    }
    return fclose(file);
}

mhe_status test_fixture_open(test_fixture *f, const char *yaml) {
    *f = (test_fixture){.host = {.size = sizeof f->host, .log = count_line, .service = no_service}};
    f->host.data = f;
    char path[300];
    if (test_folder(f->folder, sizeof f->folder) == NULL) {
        return mhe_fail(&f->err, MHE_E_IO, "no temporary folder");
    }
    (void)snprintf(path, sizeof path, "%s/config.yaml", f->folder);
    if (write_config(path, yaml) != 0) {
        return mhe_fail(&f->err, MHE_E_IO, "%s cannot be written", path);
    }
    mhe_status status = mhi_registry_create(&f->host, &f->registry, &f->err);
    if (status == MHE_OK) {
        status = mhi_run_read(path, NULL, 0, f->registry, &f->run, &f->err);
    }
    if (status == MHE_OK) {
        status = mhi_estimator_create(f->run, &f->host, &f->estimator, &f->err);
    }
    if (status == MHE_OK) {
        f->system = mhi_estimator_system(f->estimator);
        f->ocp = mhi_estimator_ocp(f->estimator);
    }
    return status;
}

void test_fixture_close(test_fixture *f) {
    char path[300];
    (void)snprintf(path, sizeof path, "%s/config.yaml", f->folder);
    (void)unlink(path);
    (void)rmdir(f->folder);
    mhe_estimator_close(f->estimator);
    mhi_run_free(f->run);
    mhi_registry_free(f->registry);
}
