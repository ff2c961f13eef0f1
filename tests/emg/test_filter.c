/* SPDX-License-Identifier: Apache-2.0 */
/* Filters against scipy 1.10. The numbers come from
 *
 *     import numpy as np, scipy.signal as s
 *     x = np.array([np.sin(0.37*k*k) + 0.1*np.cos(0.05*k) for k in range(400)])
 *     at = [0, 1, 7, 50, 199, 399]
 *     sos = s.butter(order, [low, high], 'band', fs=rate, output='sos')  # low 0: high, 'low'
 *     s.sosfilt(sos, x)[at]; s.sosfiltfilt(sos, x)[at]
 *     w = [low, (low*high)**.5]                                          # low 0: [0, high/2]
 *     sum(s.group_delay((q[:3], q[3:]), w=w, fs=rate)[1] for q in sos)
 */
#include "emg/filter.h"

#include "base/pi.h"
#include "near.h"

#include <math.h>
#include <string.h>

#define N 400
#define N_AT 6

static const int at[N_AT] = {0, 1, 7, 50, 199, 399};

static const struct reference {
    int32_t order;
    double low, high, rate;
    double once[N_AT], both[N_AT], delay[2];
} references[] = {
    {2,
     20,
     450,
     2000,
     {0.023130797944426507, 0.15624852110820425, 0.24372774568767874, 0.2234430237091658,
      -0.49230971842835164, 0.079294597136105899},
     {0.18274494052076301, 0.6701753321331364, -0.28816083366230427, 0.66452091560922599,
      -0.18326860582684018, -0.096804068769976714},
     {24.243507961545752, 1.9278811886866198}},
    {4,
     10,
     425,
     2000,
     {0.0052321644368687782, 0.047954419782829411, -0.10438194304782344, -0.38694696086009345,
      0.19041726453649044, 0.077574611467661217},
     {-0.13455601953086352, 0.36703761999875417, -0.47188144267899956, 0.76297179487052524,
      -0.20330945888591878, 0.072112742964678733},
     {122.43558246134276, 3.7138265011166833}},
    {3,
     30,
     200,
     1000,
     {0.006695796525439013, 0.053813596838316345, -0.17387635590515085, -0.035369041385106353,
      -0.46068833737799397, 0.29715198043208285},
     {-0.00092830172442670555, 0.40908145864749157, -0.37047610873262843, 0.66607500870139169,
      -0.092614813319319922, -0.081882372788933261},
     {17.332728092235016, 3.55503896257179}},
    {1,
     20,
     100,
     500,
     {0.035473657163404185, 0.20179006714542813, -0.044233676553318418, 0.56963718410370134,
      -0.71093097508233882, -0.17089488426546348},
     {-0.014637282573583724, 0.41417259091571151, -0.30914590305671513, 0.59242725183541245,
      -0.12968699375224302, -0.025244160471705759},
     {2.8568680511054634, 1.8921661834966059}},
    {2,
     0,
     6,
     2000,
     {8.7655548754014651e-06, 7.5280766401441209e-05, 0.0029763367275800262, 0.026570470953114097,
      0.025807517445622204, 0.019780938965329856},
     {0.53602582096914575, 0.52908750362758172, 0.48782269258216487, 0.23078730202293093,
      -0.033689456572551492, 0.017408590636995111},
     {75.024138225187173, 88.265329246030703}},
    {4,
     0,
     5,
     2000,
     {3.7280516432624252e-10, 4.6875991601365706e-09, 2.6597662929025162e-06, 0.0011605416613148796,
      0.043831491839310149, -0.0023640595010315543},
     {-0.32370632070381516, -0.31924229048385394, -0.29272649157683045, -0.12314082967928087,
      0.072833356053124618, 0.042852113683417702},
     {166.35334286880902, 189.74647407439838}},
    {3,
     0,
     8,
     1000,
     {1.5106422340853158e-06, 1.588347279963431e-05, 0.0025041973837244299, 0.062815908857681527,
      0.0033118293641280047, 0.085578108374462752},
     {0.08686504028278727, 0.088444528960379951, 0.096997512886886642, 0.095838611120269299,
      -0.039415260558817569, 0.11526949242547251},
     {39.780357839760498, 46.51734905322693}},
    {1,
     0,
     40,
     500,
     {0.020430082430026447, 0.12679528047511684, 0.21076327795859551, 0.20668233961623381,
      0.042159149719040348, 0.084643690614541064},
     {0.076952806168674115, 0.20560746580828346, -0.18617921190094297, 0.40666452695329641,
      -0.062439776831277355, -0.43989605685607269},
     {1.9473714274649292, 1.5928468275350536}},
    {8,
     0,
     100,
     2000,
     {1.7625537291912845e-08, 3.3497808002548597e-07, 0.0022103237680400219, 0.069664714792576604,
      -0.14677420855147152, 0.38453647209076119},
     {0.081937138000880719, 0.020640269768179596, -0.098166952816804126, 0.15887436483196238,
      -0.042894338757729786, -0.46130290332865376},
     {16.181611290162003, 17.992702152079687}},
};

static void design(const struct reference *r, mhi_filter *filter) {
    mhe_error err = {0};
    const mhe_status status =
        r->low > 0 ? mhi_filter_band_pass(r->order, r->low, r->high, r->rate, filter, &err)
                   : mhi_filter_low_pass(r->order, r->high, r->rate, filter, &err);
    assert_int_equal(status, MHE_OK);
}

static void signal_of(double *x) {
    for (int k = 0; k < N; k++) {
        x[k] = sin(0.37 * k * k) + 0.1 * cos(0.05 * k);
    }
}

/* The poles of a low-pass lie close to 1: rounding of the coefficients is amplified by their
 * inverse distance to the power of the order. */
static void once_as_scipy(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof references / sizeof references[0]; i++) {
        mhi_filter filter;
        double x[N], memory[2 * MHI_FILTER_SECTIONS_MAX] = {0};
        design(&references[i], &filter);
        signal_of(x);
        for (int k = 0; k < N; k++) {
            x[k] = mhi_filter_step(&filter, memory, x[k]);
        }
        for (int k = 0; k < N_AT; k++) {
            assert_near(x[at[k]], references[i].once[k], 1e-11);
        }
    }
}

static void both_ways_as_scipy(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof references / sizeof references[0]; i++) {
        mhi_filter filter;
        mhe_error err = {0};
        double x[N];
        design(&references[i], &filter);
        signal_of(x);
        assert_int_equal(mhi_filter_both_ways(&filter, x, N, &err), MHE_OK);
        for (int k = 0; k < N_AT; k++) {
            assert_near(x[at[k]], references[i].both[k], 1e-9);
        }
    }
}

/* 1e-8 of the delay: what rounding of the coefficients makes of poles close to 1. */
static void delay_as_scipy(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof references / sizeof references[0]; i++) {
        const struct reference *r = &references[i];
        mhi_filter filter;
        design(r, &filter);
        const double first = r->low, second = r->low > 0 ? sqrt(r->low * r->high) : r->high / 2;
        assert_near(mhi_filter_delay(&filter, first, r->rate), r->delay[0], 1e-8 * r->delay[0]);
        assert_near(mhi_filter_delay(&filter, second, r->rate), r->delay[1], 1e-8 * r->delay[1]);
    }
}

/* What is designed has its gains: 1 in the middle, 1/sqrt(2) at the corners. */
static void gains_are_those_of_butterworth(void **state) {
    (void)state;
    mhi_filter filter;
    mhe_error err = {0};
    assert_int_equal(mhi_filter_band_pass(2, 20, 450, 2000, &filter, &err), MHE_OK);
    const double frequencies[] = {20, mhi_filter_band_centre(20, 450, 2000), 450};
    const double gains[] = {sqrt(0.5), 1, sqrt(0.5)};
    for (int i = 0; i < 3; i++) {
        double memory[2 * MHI_FILTER_SECTIONS_MAX] = {0}, most = 0;
        for (int k = 0; k < 40000; k++) {
            const double phase = 2 * MHI_PI * frequencies[i] * k / 2000;
            const double y = mhi_filter_step(&filter, memory, sin(phase));
            most = k > 20000 ? fmax(most, fabs(y)) : 0;
        }
        assert_near(most, gains[i], 2e-3); /* the largest sample is not the crest */
    }
}

static void impossible_designs_are_refused(void **state) {
    (void)state;
    mhi_filter filter;
    mhe_error err = {0};
    assert_int_equal(mhi_filter_low_pass(2, 6, 12, &filter, &err), MHE_E_ARGUMENT);
    assert_non_null(strstr(err.text, "more than 12 Hz"));
    assert_int_equal(mhi_filter_low_pass(9, 6, 1000, &filter, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhi_filter_low_pass(2, NAN, 1000, &filter, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhi_filter_band_pass(2, 20, 450, 900, &filter, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhi_filter_band_pass(2, 450, 20, 2000, &filter, &err), MHE_E_ARGUMENT);
    double few[9] = {0};
    assert_int_equal(mhi_filter_low_pass(4, 5, 2000, &filter, &err), MHE_OK);
    assert_int_equal(mhi_filter_both_ways(&filter, few, 9, &err), MHE_E_INPUT);
    assert_int_equal(mhi_filter_low_pass(0, 5, 2000, &filter, &err), MHE_OK);
    assert_near(mhi_filter_step(&filter, few, 3.25), 3.25, 0.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(once_as_scipy),
        cmocka_unit_test(both_ways_as_scipy),
        cmocka_unit_test(delay_as_scipy),
        cmocka_unit_test(gains_are_those_of_butterworth),
        cmocka_unit_test(impossible_designs_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
