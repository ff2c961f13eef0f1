/* SPDX-License-Identifier: Apache-2.0 */
/* refine.c: the steps over an interval, halved where they have no solution or err too much.
 *
 * The stages make a polynomial p(t) with p'' = f(p) at their times. Elsewhere it has a defect
 * f(p(t)) - p''(t), which is (c_0 + c_1 t) M(t), M = prod (t - c_j), where f is linear, and close
 * to that where f is smooth. Terms t^e M with e < stages - 1 are orthogonal to what the end of the
 * step is off by, so a test takes some of them out of the defects at its probes; what is left tells
 * a kink or a jump of f. The tests go from cheap to sharp, and the first that a step passes ends
 * them: on slow motion that is the one at both ends. Each is scaled, by moving a jump and a kink
 * through the step, so that it bounds the error that either leaves in v.
 *
 * The activations in f are the polynomial that the stages see (activation.c), whose own error is
 * not judged. */
#include "rk.h"

#include <math.h>
#include <string.h>

/* A step without a solution is halved this often. */
#define RK_HALVINGS 3
/* And one that errs too much this often: down to nanoseconds, where no jump of a force counts. */
#define RK_DEPTH 20
/* Places of a jump or a kink that a test is scaled for. */
#define RK_PLACES 256

/* ---- tests ---- */

/* Takes the terms of a test out of the n_probes defects; returns the largest rest. */
static double rk_rest(const struct rk_test *test, double *defect) {
    double largest = 0;
    for (int32_t e = 0; e < test->terms; e++) {
        double part = 0;
        for (int32_t i = 0; i < test->probes; i++) {
            part += test->basis[e][i] * defect[i];
        }
        for (int32_t i = 0; i < test->probes; i++) {
            defect[i] -= part * test->basis[e][i];
        }
    }
    for (int32_t i = 0; i < test->probes; i++) {
        largest = fmax(largest, fabs(defect[i]));
    }
    return largest;
}

/* Orthonormal: M(t), t M(t), t^2 M(t) at the probes. */
static void rk_test_basis(const struct rk_tableau *t, const struct rk_probe *probes,
                          struct rk_test *test) {
    int32_t n = test->probes;
    for (int32_t e = 0; e < test->terms; e++) {
        double *basis = test->basis[e], norm = 0;
        for (int32_t i = 0; i < n; i++) {
            basis[i] = pow(2 * probes[i].t - 1, e);
            for (int32_t j = 0; j < t->stages; j++) {
                basis[i] *= 2 * (probes[i].t - t->c[j]);
            }
        }
        for (int32_t k = 0; k < e; k++) {
            double part = 0;
            for (int32_t i = 0; i < n; i++) {
                part += basis[i] * test->basis[k][i];
            }
            for (int32_t i = 0; i < n; i++) {
                basis[i] -= part * test->basis[k][i];
            }
        }
        for (int32_t i = 0; i < n; i++) {
            norm += basis[i] * basis[i];
        }
        for (int32_t i = 0; i < n; i++) {
            basis[i] /= sqrt(norm);
        }
    }
}

/* Error of the quadrature of ((x - t)+)^power from 0 to 1 over the rest that the test sees. */
static double rk_test_ratio(const struct rk_tableau *t, const struct rk_probe *probes,
                            const struct rk_test *test, double x, int32_t power) {
    double value[RK_MAX_STAGES], defect[RK_PROBES], error = -pow(1 - x, power + 1) / (power + 1);
    for (int32_t k = 0; k < t->stages; k++) {
        value[k] = t->c[k] > x ? pow(t->c[k] - x, power) : 0;
        error += t->b[k] * value[k];
    }
    for (int32_t i = 0; i < test->probes; i++) {
        defect[i] = probes[i].t > x ? pow(probes[i].t - x, power) : 0;
        for (int32_t k = 0; k < t->stages; k++) {
            defect[i] -= probes[i].at[k] * value[k];
        }
    }
    return fabs(error) / rk_rest(test, defect);
}

void rk_tests(const struct rk_tableau *t, const struct rk_probe *probes, struct rk_test *out) {
    static const struct {
        int32_t probes, terms;
    } kinds[RK_TESTS] = {{2, 0}, {3, 1}, {5, 2}, {5, 3}};
    for (int32_t i = 0; i < RK_TESTS; i++) {
        struct rk_test *test = &out[i];
        int32_t terms = kinds[i].terms;
        *test = (struct rk_test){.probes = kinds[i].probes,
                                 .terms = terms < t->stages ? terms : t->stages - 1};
        rk_test_basis(t, probes, test);
        for (int32_t k = 0; k < RK_PLACES; k++) {
            double x = (k + 0.5) / RK_PLACES;
            test->scale = fmax(test->scale, rk_test_ratio(t, probes, test, x, 0));
            test->scale = fmax(test->scale, rk_test_ratio(t, probes, test, x, 1));
        }
    }
}

/* ---- the step just solved ---- */

/* The polynomial's activations at a probe. */
static void rk_probe_activations(struct rk_context *c, const struct rk_probe *probe) {
    int32_t n_m = c->rk->system->n_m;
    memset(c->probe_a, 0, sizeof(double) * (size_t)n_m);
    for (int32_t k = 0; k < c->rk->mechanics.stages; k++) {
        for (int32_t i = 0; i < n_m; i++) {
            c->probe_a[i] += probe->at[k] * c->stage_a[k * n_m + i];
        }
    }
}

/* f there. */
static mhe_status rk_probe(struct rk_context *c, const double *r, double h,
                           const struct rk_probe *probe, double *out, mhe_error *err) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q;
    const mhe_acceleration want = {.size = sizeof want, .vdot = out};
    rk_probe_activations(c, probe);
    for (int32_t i = 0; i < n_q; i++) {
        double dv = 0, dq = 0;
        for (int32_t k = 0; k < c->rk->mechanics.stages; k++) {
            dv += probe->v[k] * c->K[k * n_q + i];
            dq += probe->q[k] * c->K[k * n_q + i];
        }
        c->stage_v[i] = c->v[i] + h * dv;
        c->stage_q[i] = c->q[i] + h * (probe->t * c->v[i] + h * dq);
    }
    return rk_accelerate(c, c->stage_q, c->stage_v, c->probe_a, NULL, r, &want, err);
}

/* Whether steps are tested at all: the tests are those of Gauss schemes. */
static int rk_judged(const struct rk *rk) {
    return rk->config.tolerance > 0 && rk->config.scheme == RK_GAUSS;
}

void rk_keep_start(struct rk_context *c) {
    int32_t n_q = c->rk->system->n_q, n_m = c->rk->system->n_m;
    if (!rk_judged(c->rk)) {
        return;
    }
    c->start_kept = 1;
    rk_probe_activations(c, &c->rk->probes[0]);
    for (int32_t i = 0; i < n_q; i++) {
        c->defect[i] = c->f[i];
        for (int32_t m = 0; m < n_m; m++) {
            c->defect[i] += c->at->f_a[i * n_m + m] * (c->probe_a[m] - c->a_start[m]);
        }
    }
}

static double rk_test(const struct rk_context *c, double h, const struct rk_test *test) {
    int32_t n_q = c->rk->system->n_q;
    double largest = 0;
    for (int32_t i = 0; i < n_q; i++) {
        double defect[RK_PROBES];
        for (int32_t k = 0; k < test->probes; k++) {
            defect[k] = c->defect[k * n_q + i];
        }
        largest = fmax(largest, rk_rest(test, defect) / fmax(1, fabs(c->v[i])));
    }
    return h * test->scale * largest;
}

/* Whether the step just solved errs by less than the tolerance, in units of max(1, |v|). */
static mhe_status rk_accurate(struct rk_context *c, const double *r, double h, int *accurate,
                              mhe_error *err) {
    const struct rk *rk = c->rk;
    int32_t n_q = rk->system->n_q, seen = 0;
    *accurate = 0;
    for (int32_t i = 0; i < RK_TESTS && !*accurate; i++) {
        for (; seen < rk->tests[i].probes; seen++) {
            double *defect = c->defect + seen * n_q;
            mhe_status status = seen == 0 && c->start_kept
                                    ? MHE_OK
                                    : rk_probe(c, r, h, &rk->probes[seen], defect, err);
            if (status != MHE_OK) {
                return status;
            }
            for (int32_t k = 0; k < rk->mechanics.stages; k++) {
                for (int32_t m = 0; m < n_q; m++) {
                    defect[m] -= rk->probes[seen].at[k] * c->K[k * n_q + m];
                }
            }
        }
        *accurate = rk_test(c, h, &rk->tests[i]) < rk->config.tolerance;
    }
    return MHE_OK;
}

/* ---- the interval ---- */

/* Keeps or brings back the activations of the start of a step; the other states only move once it
 * is accepted. */
static void rk_hold(struct rk_context *c, int back) {
    size_t pad = (size_t)c->rk->pad;
    double *const now[] = {c->a, c->a_a, c->a_e};
    for (int i = 0; i < 3; i++) {
        double *held = c->held + (size_t)i * pad;
        memcpy(back ? now[i] : held, back ? held : now[i], sizeof(double) * pad);
    }
}

/* One step of length h from where the context is; `cut` tells that it was not taken. */
static mhe_status rk_try(struct rk_context *c, const double *u, double h, int depth,
                         int32_t derivatives, int *cut, mhe_error *err) {
    const struct rk *rk = c->rk;
    const mhe_system *system = rk->system;
    const double *r = system->n_r > 0 ? u + system->n_m : NULL;
    int judged = rk_judged(rk), accurate = 1;
    mhe_status status = MHE_OK;
    c->start_kept = 0;
    if (system->n_d > 0) {
        rk_hold(c, 0);
        status = rk_activations(c, u, h, derivatives, err);
    }
    if (status == MHE_OK) {
        status = rk_mechanics(c, r, h, derivatives, err);
    }
    if (status == MHE_OK && judged && depth < RK_DEPTH) {
        status = rk_accurate(c, r, h, &accurate, err);
    }
    *cut = status == MHE_OK ? !accurate
                            : status == MHE_RETRY && depth < (judged ? RK_DEPTH : RK_HALVINGS);
    if (*cut && system->n_d > 0) {
        rk_hold(c, 1);
    }
    if (*cut || status != MHE_OK) {
        return *cut ? MHE_OK : status;
    }
    return rk_advance(c, h, derivatives, err);
}

mhe_status rk_steps(struct rk_context *c, const double *u, int32_t n, double h, int32_t derivatives,
                    mhe_error *err) {
    int32_t depth = 0, at = 0; /* steps of h / 2^depth, `at` of them done since a whole one */
    for (int32_t k = 0; k < n;) {
        int cut = 0;
        c->slot = depth == 0 ? k : c->rk->memory_steps;
        mhe_status status = rk_try(c, u, ldexp(h, -depth), depth, derivatives, &cut, err);
        if (status != MHE_OK) {
            return status;
        }
        if (cut) {
            depth++;
            at *= 2;
            continue;
        }
        for (at++; depth > 0 && at % 2 == 0; depth--) {
            at /= 2;
        }
        if (depth == 0) {
            at = 0;
            k++;
        }
    }
    return MHE_OK;
}
