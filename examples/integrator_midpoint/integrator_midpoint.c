/* SPDX-License-Identifier: Apache-2.0 */
/* integrator_midpoint: the explicit midpoint rule with the exact derivatives of its steps.
 *
 *     y = x + h/2 f(x),   x' = x + h f(y)
 *     dx'/dx = I + h F(y) (I + h/2 F(x)),   dx'/du = h (G(y) + h/2 F(y) G(x))
 * with F = df/dx, G = df/du, in `steps` equal steps h of an interval: the result depends smoothly
 * on the interval's length, and shorter intervals are more exact. */
#include <mhe/integrator.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct midpoint { /* filled and range-checked by the core */
    int32_t steps;
};

static const mhe_option midpoint_options[] = {
    MHE_OPT_INT(struct midpoint, steps, 15, 1, 10000, "1", "Steps of an interval."),
};

typedef struct instance {
    const mhe_system *system;
    int32_t steps;
} instance;

/* One thread's memory. Matrices are row-major, F [n_x x n_x], G [n_x x n_u]. */
typedef struct context {
    const instance *of;
    void *system_context;
    double *x, *y, *f, *F, *G, *Fy, *Gy, *step_x, *step_u, *product; /* of `memory` */
    double *vdot_q, *vdot_v, *vdot_a, *vdot_r, *d_rate, *rate_c, *rate_d;
    double memory[];
} context;

static mhe_status midpoint_accepts(const mhe_system *s, const void *config, mhe_error *err) {
    (void)config;
    return s->n_z == 0 && s->n_p == 0
               ? MHE_OK
               : mhe_fail(err, MHE_E_UNSUPPORTED,
                          "takes no muscles with states beside the activation, and no parameters");
}

static mhe_status midpoint_create(const mhe_host *host, const mhe_system *system,
                                  const void *config, void **self, mhe_error *err) {
    (void)host;
    instance *m = malloc(sizeof *m);
    if (m == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *m = (instance){system, ((const struct midpoint *)config)->steps};
    *self = m;
    return MHE_OK;
}

static void midpoint_destroy(void *self) {
    free(self);
}

static mhe_status midpoint_context_create(const void *self, void *system_context, void **out,
                                          mhe_error *err) {
    const instance *m = self;
    const mhe_system *s = m->system;
    const size_t n_x = (size_t)s->n_x, n_u = (size_t)s->n_u, n_q = (size_t)s->n_q;
    const size_t n_m = (size_t)s->n_m, n_r = (size_t)s->n_r;
    const size_t sizes[] = {n_x,       n_x,       n_x,       n_x * n_x, n_x * n_u,
                            n_x * n_x, n_x * n_u, n_x * n_x, n_x * n_u, n_x * (n_x + n_u),
                            n_q * n_q, n_q * n_q, n_q * n_m, n_q * n_r, n_m,
                            n_m,       n_m};
    size_t all = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        all += sizes[i];
    }
    context *c = calloc(1, sizeof *c + sizeof(double) * all);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    double **const pieces[] = {&c->x,      &c->y,      &c->f,      &c->F,      &c->G,
                               &c->Fy,     &c->Gy,     &c->step_x, &c->step_u, &c->product,
                               &c->vdot_q, &c->vdot_v, &c->vdot_a, &c->vdot_r, &c->d_rate,
                               &c->rate_c, &c->rate_d};
    double *at = c->memory;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        *pieces[i] = at;
        at += sizes[i];
    }
    c->of = m;
    c->system_context = system_context;
    *out = c;
    return MHE_OK;
}

static void midpoint_context_destroy(void *self) {
    free(self);
}

/* f(x, u), and where F is not NULL its derivatives F and G. x = [q, v, d], u = [c, r]. */
static mhe_status rates(context *c, const double *x, const double *u, const double *w, double *f,
                        double *F, double *G, mhe_error *err) {
    const mhe_system *s = c->of->system;
    const int32_t n_x = s->n_x, n_u = s->n_u, n_q = s->n_q, n_d = s->n_d, n_r = s->n_r;
    const double *d = n_d > 0 ? x + s->first_d : NULL, *r = n_r > 0 ? u + s->n_m : NULL;
    const mhe_system_point at = {.size = sizeof at,
                                 .q = x,
                                 .v = x + n_q,
                                 .a = n_d > 0 ? d : u, /* activation-driven: the control */
                                 .c = u,
                                 .r = r,
                                 .w = w};
    mhe_acceleration out = {.size = sizeof out, .vdot = f + n_q};
    if (F != NULL) {
        out.vdot_q = c->vdot_q;
        out.vdot_v = c->vdot_v;
        out.vdot_a = c->vdot_a;
        out.vdot_r = n_r > 0 ? c->vdot_r : NULL;
    }
    mhe_status status = s->acceleration(s, c->system_context, &at, &out, err);
    if (status == MHE_OK && n_d > 0) {
        status = s->activation_rate(s, u, d, f + s->first_d, F != NULL ? c->rate_c : NULL,
                                    F != NULL ? c->rate_d : NULL, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    memcpy(f, x + n_q, sizeof(double) * (size_t)n_q);
    if (F == NULL) {
        return MHE_OK;
    }
    memset(F, 0, sizeof(double) * (size_t)(n_x * n_x));
    memset(G, 0, sizeof(double) * (size_t)(n_x * n_u));
    for (int32_t i = 0; i < n_q; i++) {
        double *row = F + (n_q + i) * n_x, *row_u = G + (n_q + i) * n_u;
        F[i * n_x + n_q + i] = 1;
        memcpy(row, c->vdot_q + i * n_q, sizeof(double) * (size_t)n_q);
        memcpy(row + n_q, c->vdot_v + i * n_q, sizeof(double) * (size_t)n_q);
        memcpy(n_d > 0 ? row + s->first_d : row_u, c->vdot_a + i * s->n_a,
               sizeof(double) * (size_t)s->n_a);
        if (n_r > 0) {
            memcpy(row_u + s->n_m, c->vdot_r + i * n_r, sizeof(double) * (size_t)n_r);
        }
    }
    for (int32_t i = 0; i < n_d; i++) {
        F[(s->first_d + i) * n_x + s->first_d + i] = c->rate_d[i];
        G[(s->first_d + i) * n_u + i] = c->rate_c[i];
    }
    return MHE_OK;
}

/* C [n x m] = A [n x n] B [n x m] */
static void multiply(const double *A, const double *B, int32_t n, int32_t m, double *C) {
    memset(C, 0, sizeof(double) * (size_t)(n * m));
    for (int32_t i = 0; i < n; i++) {
        for (int32_t k = 0; k < n; k++) {
            for (int32_t j = 0; j < m; j++) {
                C[i * m + j] += A[i * n + k] * B[k * m + j];
            }
        }
    }
}

/* The step's derivatives from F, G at its begin and Fy, Gy at its middle: step_x, step_u; and with
 * them those of all steps so far. */
static void chain(context *c, double h, const mhe_step_derivatives *out) {
    const int32_t n = c->of->system->n_x, m = c->of->system->n_u;
    multiply(c->Fy, c->F, n, n, c->step_x);
    multiply(c->Fy, c->G, n, m, c->step_u);
    for (int32_t i = 0; i < n * n; i++) {
        c->step_x[i] = h * (c->Fy[i] + 0.5 * h * c->step_x[i]);
    }
    for (int32_t i = 0; i < n; i++) {
        c->step_x[i * n + i] += 1;
    }
    for (int32_t i = 0; i < n * m; i++) {
        c->step_u[i] = h * (c->Gy[i] + 0.5 * h * c->step_u[i]);
    }
    multiply(c->step_x, out->A, n, n, c->product);
    memcpy(out->A, c->product, sizeof(double) * (size_t)(n * n));
    multiply(c->step_x, out->B, n, m, c->product);
    for (int32_t i = 0; i < n * m; i++) {
        out->B[i] = c->product[i] + c->step_u[i];
    }
}

static mhe_status midpoint_step(void *self, const double *x, const double *u, const double *w,
                                double dt, double *memory, double *x_next,
                                const mhe_step_derivatives *out, mhe_error *err) {
    context *c = self;
    const int32_t n = c->of->system->n_x, m = c->of->system->n_u;
    const double h = dt / c->of->steps;
    const int32_t wanted = out != NULL && out->A != NULL;
    mhe_status status = MHE_OK;
    (void)memory;
    memcpy(c->x, x, sizeof(double) * (size_t)n);
    if (wanted) {
        memset(out->A, 0, sizeof(double) * (size_t)(n * n));
        memset(out->B, 0, sizeof(double) * (size_t)(n * m));
        for (int32_t i = 0; i < n; i++) {
            out->A[i * n + i] = 1;
        }
    }
    for (int32_t k = 0; k < c->of->steps && status == MHE_OK; k++) {
        status = rates(c, c->x, u, w, c->f, wanted ? c->F : NULL, c->G, err);
        for (int32_t i = 0; i < n && status == MHE_OK; i++) {
            c->y[i] = c->x[i] + 0.5 * h * c->f[i];
        }
        if (status == MHE_OK) {
            status = rates(c, c->y, u, w, c->f, wanted ? c->Fy : NULL, c->Gy, err);
        }
        for (int32_t i = 0; i < n && status == MHE_OK; i++) {
            c->x[i] += h * c->f[i];
        }
        if (status == MHE_OK && wanted) {
            chain(c, h, out);
        }
    }
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        status = isfinite(c->x[i]) ? MHE_OK : mhe_fail(err, MHE_RETRY, "the state is not finite");
    }
    if (status == MHE_OK) {
        memcpy(x_next, c->x, sizeof(double) * (size_t)n);
    }
    return status;
}

static const mhe_integrator_ops midpoint_ops = {.size = sizeof midpoint_ops,
                                                .create = midpoint_create,
                                                .destroy = midpoint_destroy,
                                                .context_create = midpoint_context_create,
                                                .context_destroy = midpoint_context_destroy,
                                                .step = midpoint_step,
                                                .accepts = midpoint_accepts};

static const mhe_plugin midpoint_plugin = {.size = sizeof midpoint_plugin,
                                           .id = "org.example.integrator.midpoint",
                                           .version = "1.0.0",
                                           .summary = "The explicit midpoint rule.",
                                           .iface = MHE_INTEGRATOR_IFACE,
                                           .ops = &midpoint_ops,
                                           MHE_PLUGIN_OPTIONS(struct midpoint, midpoint_options)};

MHE_PLUGIN_LIBRARY(&midpoint_plugin)
