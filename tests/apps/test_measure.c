/* SPDX-License-Identifier: Apache-2.0 */
/* Percentiles, and the logarithmic axis that rates are drawn on. */
#include "figure.h"
#include "measure.h"
#include "support.h"

#include <math.h>
#include <string.h>

static void percentiles_are_of_nearest_rank(void **state) {
    (void)state;
    double v[] = {5, 1, 4, 2, 3, 6, 7, 8, 10, 9};
    measure_sort(v, 10);
    for (int i = 0; i < 10; i++) {
        assert_true(v[i] == i + 1);
    }
    assert_true(measure_percentile(v, 10, 0) == 1);
    assert_true(measure_percentile(v, 10, 0.5) == 5);
    assert_true(measure_percentile(v, 10, 0.91) == 10);
    assert_true(measure_percentile(v, 10, 1) == 10);
    assert_true(measure_percentile(v, 1, 0.5) == 1);
    assert_true(isnan(measure_percentile(v, 0, 0.5)));
    assert_true(measure_median(v, 10) == 5.5);
    assert_true(measure_median(v, 9) == 5);
    assert_true(measure_median(v, 1) == 1);
}

/* The script of one panel per value of `rates`. */
static mhi_text script_of(const double *rates, int32_t n) {
    static const double window = 7;
    static figure f;
    f = (figure){.program = "test",
                 .name = "rate",
                 .abscissa = "window",
                 .per_row = 2,
                 .begin = 6,
                 .end = 8,
                 .n_blocks = 1,
                 .n_panels = n};
    f.blocks[0] = (figure_block){.heading = "h", .axis = "a", .logarithmic = 1, .n_panels = n};
    for (int32_t i = 0; i < n; i++) {
        f.panels[i].name = "p";
        f.panels[i].n_series = 1;
        f.panels[i].series[0] = (figure_series){&window, &rates[i], 1, 1, 1, FIGURE_MADE};
    }
    mhi_text script = {0};
    figure_script(&f, &script);
    assert_int_equal(script.failed, 0);
    return script;
}

static int32_t times(const char *text, const char *part) {
    int32_t n = 0;
    for (const char *at = strstr(text, part); at != NULL; at = strstr(at + 1, part)) {
        n++;
    }
    return n;
}

static void panels_share_a_logarithmic_axis(void **state) {
    (void)state;
    static const struct {
        double rates[2];
        const char *steps;
    } cases[] = {{{13.3, 104}, "set ytics (10,20,50,100,200)\n"},
                 {{900, 30}, "set ytics (10,20,50,100,200,500,1000)\n"},
                 {{0.03, 0.3}, "set ytics (0.01,0.02,0.05,0.1,0.2,0.5)\n"},
                 {{1, 1}, "set ytics (1,2)\n"},
                 {{0, 5}, "set ytics (1,2,5,10,20)\n"}, /* zero is not on such an axis */
                 {{NAN, NAN}, "set ytics (1,2,5,10,20)\n"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        mhi_text script = script_of(cases[i].rates, 2);
        assert_int_equal(times(script.data, cases[i].steps), 2);
        assert_int_equal(times(script.data, "with linespoints"), 2);
        assert_int_equal(times(script.data, "set xlabel 'window'"), 2);
        mhi_text_free(&script);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(percentiles_are_of_nearest_rank),
                                       cmocka_unit_test(panels_share_a_logarithmic_axis)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
