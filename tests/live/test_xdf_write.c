/* SPDX-License-Identifier: Apache-2.0 */
/* What is recorded is read back to the bit, at any moment of the recording. */
#include "io/xdf.h"
#include "live/xdf_write.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void to_the_bit(void **state) {
    (void)state;
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/a.xdf", folder);
    mhi_xdf_writer *w = NULL;
    mhi_xdf *back = NULL;
    mhe_error err = {0};
    const mhi_xdf_column columns[] = {{.label = "bic <1> & co", .unit = "V"},
                                      {.label = "tri", .named = "1"}};
    const double stamps[] = {1.0 / 3, 2.0 / 3, 7.1}, values[] = {0.1, -1e-300, 3, 1e300, -0.0, 7};
    uint32_t id = 0;
    assert_int_equal(mhi_xdf_create(path, &w, &err), MHE_OK);
    assert_int_equal(mhi_xdf_add_stream(w, "emg", "EMG", 0, columns, 2, "a\nnote", &id, &err),
                     MHE_OK);
    assert_int_equal(mhi_xdf_put(w, id, 2, 2, stamps, values, &err), MHE_OK);
    assert_int_equal(mhi_xdf_read(path, &back, &err), MHE_OK); /* while it is written */
    assert_int_equal(back->streams[0].n_samples, 2);
    mhi_xdf_free(back);
    assert_int_equal(mhi_xdf_put(w, id, 2, 1, stamps + 2, values + 4, &err), MHE_OK);
    assert_int_equal(mhi_xdf_put_offset(w, id, 1, -5, &err), MHE_OK);
    assert_int_equal(mhi_xdf_close(w, &err), MHE_OK);
    assert_int_equal(mhi_xdf_read(path, &back, &err), MHE_OK);
    const mhi_xdf_stream *s = &back->streams[0];
    assert_string_equal(s->channels[0].label, "bic <1> & co");
    assert_string_equal(s->channels[0].unit, "V");
    assert_int_equal(s->n_samples, 3);
    assert_memory_equal(s->stamp, stamps, sizeof stamps);
    assert_memory_equal(s->values, values, sizeof values);
    assert_true(s->time[0] == stamps[0] - 5);
    mhi_xdf_free(back);
    assert_int_equal(mhi_xdf_create(path, &w, &err), MHE_E_IO); /* never over another */
    assert_non_null(strstr(err.text, "a.xdf: cannot be begun"));
    (void)unlink(path);
    (void)rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(to_the_bit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
