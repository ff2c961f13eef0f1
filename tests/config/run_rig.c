/* SPDX-License-Identifier: Apache-2.0 */
#include "run_rig.h"

#include <stdio.h>
#include <string.h>

static void ignore_log(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

const mhe_host run_host = {.size = sizeof run_host, .log = ignore_log, .service = no_service};

void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fputs(text, file) >= 0, 1);
    assert_int_equal(fclose(file), 0);
}

struct outcome read_path(const char *path, const char *const *set, int32_t n_set) {
    struct outcome o = {0};
    assert_int_equal(mhi_registry_create(&run_host, &o.registry, &o.err), MHE_OK);
    mhi_registry_trust_files(o.registry, 1);
    o.status = mhi_run_read(path, set, n_set, o.registry, &o.run, &o.err);
    assert_int_equal(o.run == NULL, o.status != MHE_OK);
    return o;
}

void release(struct outcome *o) {
    mhi_run_free(o->run);
    mhi_registry_free(o->registry);
}

struct outcome read_good(const char *yaml, const char *const *set, int32_t n_set) {
    write_file(FILE_NAME, yaml);
    struct outcome o = read_path(FILE_NAME, set, n_set);
    assert_string_equal(o.err.text, "");
    assert_int_equal(o.status, MHE_OK);
    return o;
}

void assert_refused_set(const char *yaml, const char *set, mhe_status code, const char *message) {
    write_file(FILE_NAME, yaml);
    struct outcome o = read_path(FILE_NAME, &set, set != NULL);
    assert_int_equal(o.status, code);
    const char *text = o.err.text;
    if (strncmp(text, FILE_NAME, strlen(FILE_NAME)) == 0) {
        text += strlen(FILE_NAME);
    }
    assert_string_equal(text, message);
    release(&o);
}

void assert_refused(const char *yaml, const char *message) {
    assert_refused_set(yaml, NULL, MHE_E_CONFIG, message);
}
