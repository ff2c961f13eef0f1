/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"
#include "base/text.h"
#include "support.h"

#include <string.h>

static void nearest_name(void **state) {
    (void)state;
    const char *names[] = {"tolerance", "max_iterations", "window"};
    assert_string_equal(mhi_nearest("tolerence", names, 3), "tolerance");
    assert_string_equal(mhi_nearest("Max_Iteration", names, 3), "max_iterations");
    assert_null(mhi_nearest("zzzzzzzzzz", names, 3));
    assert_string_equal(mhi_nearest("tol", names, 3), "tolerance"); /* a name half written */
    assert_null(mhi_nearest("widows on", names, 3)); /* half of the letters fit by chance */
    char out[96];
    assert_string_equal(mhi_suggest(out, sizeof out, "windw", names, 3),
                        " (did you mean 'window'?)");
    assert_string_equal(mhi_suggest(out, sizeof out, "qqqqqqqqqqqqqq", names, 3),
                        " (valid: tolerance, max_iterations, window)");
    char small[24];
    mhi_suggest(small, sizeof small, "qqqqqqqqqqqqqq", names, 3);
    assert_true(strlen(small) < sizeof small);
}

static void text_grows(void **state) {
    (void)state;
    mhi_text text = {0};
    for (int i = 0; i < 1000; i++) {
        mhi_text_add(&text, "%d,", i);
    }
    assert_int_equal(text.failed, 0);
    assert_int_equal(strlen(text.data), text.length);
    assert_int_equal(strncmp(text.data, "0,1,2,", 6), 0);
    mhi_text_free(&text);
}

static void arena_is_aligned_and_zeroed(void **state) {
    (void)state;
    mhi_arena arena = {0};
    for (int i = 0; i < 100; i++) {
        unsigned char *bytes = mhi_arena_take(&arena, (size_t)i);
        assert_int_equal((uintptr_t)bytes % 64, 0);
        for (int k = 0; k < i; k++) {
            assert_int_equal(bytes[k], 0);
        }
        memset(bytes, 0xff, (size_t)i);
    }
    assert_string_equal(mhi_arena_format(&arena, "%s-%d", "a", 3), "a-3");
    mhi_arena_free(&arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nearest_name), cmocka_unit_test(text_grows),
                                       cmocka_unit_test(arena_is_aligned_and_zeroed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
