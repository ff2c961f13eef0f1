/* SPDX-License-Identifier: Apache-2.0 */
/* rk.h: Runge-Kutta schemes on the musculoskeletal shape of mhe/integrator.h.
 *
 * A step of length h is split by structure. Activations are scalar equations that see neither q nor
 * v: they are carried first, by collocation on steps of their own (activation.c). What remains,
 * q'' = f(q, v, a(t), r), is solved for the stage accelerations K_j alone (mechanics.c):
 *     v_j = v + h sum_k A_jk K_k,   q_j = q + h c_j v + h^2 sum_k (A A)_jk K_k
 *     K_j = f(q_j, v_j, a_j, r)
 *     v+ = v + h sum_j b_j K_j,     q+ = q + h v + h^2 sum_j (b A)_j K_j
 * With a tolerance, steps that err by more are halved (refine.c). */
#ifndef INTEGRATOR_RK_H
#define INTEGRATOR_RK_H

#include <mhe/integrator.h>

#define RK_MAX_STAGES 6
#define RK_ACTIVATION_STAGES 4
#define RK_LANES 4   /* muscles that are computed side by side */
#define RK_WEIGHED 4 /* activation steps in a mechanical one, whose weights are known ahead */
#define RK_PROBES 5
#define RK_TESTS 4
#define RK_MAX_STATES 8 /* of a muscle in z */
#define RK_AUTO 0
#define RK_GAUSS 1
#define RK_RADAU 2
#define RK_RK4 3

/* Filled by the core from the option table in plugin.c. */
struct rk_config {
    int32_t scheme; /* RK_GAUSS ...; in an instance never RK_AUTO */
    int32_t stages; /* Gauss and Radau; 0, and in the steps: the scheme's own */
    double max_step;
    double newton_tolerance;
    int32_t max_newton;
    double activation_step; /* in their shortest time constants */
    double tolerance;       /* 0: none */
};

/* Row-major, `stages` wide. Stage times c do not decrease. */
struct rk_tableau {
    int32_t stages;
    int32_t is_explicit;
    int32_t terms; /* of the polynomial that stands for an activation over a step */
    double c[RK_MAX_STAGES], b[RK_MAX_STAGES];
    double A[RK_MAX_STAGES * RK_MAX_STAGES];
    double AA[RK_MAX_STAGES * RK_MAX_STAGES]; /* A A */
    double bA[RK_MAX_STAGES];                 /* b A */
};

void rk_tableau_gauss(int32_t stages, struct rk_tableau *out); /* 1..RK_MAX_STAGES */
void rk_tableau_radau(int32_t stages, struct rk_tableau *out);
void rk_tableau_rk4(struct rk_tableau *out);

/* A time between the stages. On a step of length h the collocation polynomial has there the
 * acceleration sum_k at_k K_k, and
 * v(t) = v + h sum_k v_k K_k,   q(t) = q + h t v + h^2 sum_k q_k K_k. */
struct rk_probe {
    double t; /* in 0..1 */
    double at[RK_MAX_STAGES], v[RK_MAX_STAGES], q[RK_MAX_STAGES];
};

/* A test of a step on the defects at its first probes (refine.c). */
struct rk_test {
    int32_t probes, terms;
    double basis[RK_PROBES]
                [RK_PROBES]; /* [terms x probes] what a smooth step may have of defects */
    double scale;            /* of the rest, to bound the error in v */
};

struct rk {
    const mhe_system *system;
    struct rk_config config;
    struct rk_tableau mechanics, activation;
    struct rk_probe probes[RK_PROBES]; /* Gauss only, and the tests */
    struct rk_test tests[RK_TESTS];
    int32_t pad; /* n_m in whole lanes */
    /* memory of an interval: steps, steps of the activations in one of them, doubles of a step */
    int32_t memory_steps, memory_traces, memory_stride;
};

/* A mechanical step as it was linearised last, and where the next one near it starts from. */
struct rk_slot {
    double *step;                  /* [1] its length; 0: nothing is known */
    double *q, *v, *r, *stage_a;   /* [n_q], [n_q], [n_r], [s x n_m] its data */
    double *w;                     /* [n_w] the interval's inputs */
    double *K;                     /* [s x n_q] the stages it found */
    double *f_q, *f_v, *f_a, *f_r; /* [s x ...] derivatives at the stages */
    double *f_p, *h_p;             /* [s x n_q x n_p], [s x n_z x n_p] */
    double *lu;                    /* [s n_q x s n_q] LU of the stage equations */
    int32_t *pivots;               /* [s n_q] */
    /* where there are states z (states.c) */
    double *z, *u;                       /* [n_z], [n_m] data */
    double *Z;                           /* [s x n_z] the stages it found */
    double *f_z;                         /* [s x n_q x n_z] */
    double *h_q, *h_v, *h_a, *h_c, *h_z; /* [s x n_z x n_q] .. [s x n_z], [s x n_z x n_k] */
    double *P;                           /* [n_m x (s n_k)^2] */
    double *E;                           /* [s n_z x s n_q] */
};

/* The same of a step of the activations. */
struct rk_trace {
    double *step;                /* [1] its length; 0: nothing is known */
    double *a, *e;               /* [n_m] its start and control */
    double *value, *by_a, *by_e; /* [4 x pad] stage values, their derivatives */
};

/* One thread's memory; s is mechanics.stages. The carried state is (q, v, a); `sens` is its
 * derivative by (q, v, a, controls) at the start of the interval. */
struct rk_context {
    const struct rk *rk;
    void *system_context;
    double *arrays;      /* all arrays below */
    double *memory;      /* the interval's, NULL: none */
    const double *u, *w; /* controls and inputs of the interval */
    int32_t step;        /* mechanical steps done in the interval */
    int32_t slot;        /* of the present one in the memory; memory_steps: none */

    /* activations */
    double *a, *a_a, *a_e;             /* [pad] value now; its derivatives by start and control */
    double *a_start;                   /* [n_m] at the start of the mechanical step */
    double *stage_a;                   /* [s x n_m] as the stages of the mechanical step see them */
    double *stage_a_a, *stage_a_e;     /* [s x n_m] */
    double *slope, *slope_a, *slope_e; /* [4 x pad] stage slopes of an activation step */
    double *guess, *guess_a, *guess_e; /* [4 x pad] stage values of an activation step */
    double *weights;                   /* [n, k][s x 4] see rk_activation_weights() */
    struct rk_trace trace;             /* the context's own */

    /* mechanics */
    double *q, *v;             /* [n_q] */
    double *K;                 /* [s x n_q] */
    double *stage_q, *stage_v; /* [n_q] of the stage in work */
    double *f;                 /* [s x n_q] */
    double *residual;          /* [s n_q] */
    double *defect;            /* [RK_PROBES x n_q] of the step just solved */
    double *probe_a;           /* [n_m] */
    double *held;              /* [3 x pad] a, a_a, a_e at the start of a step */
    int32_t start_kept;        /* whether f at the first probe is there already */
    struct rk_slot own, kept;  /* linearisations: the context's; the memory's of this step */
    struct rk_slot *at;        /* the one in use */
    int32_t keeps;             /* this call may write to `kept` */
    double *adjoint;           /* [s n_q x 2 n_q] d(q+, v+)/d(right-hand sides), transposed */
    double *carry;             /* [2 n_q x 2 n_q] d(q+, v+)/d(q, v), transposed */
    double *direct;            /* [2 n_q x n_m or n_q] */
    double *sens, *sens_next;  /* [2 n_q + n_z x columns]; the first alone where there is z */
    int32_t columns;           /* n_x + n_u + n_p */

    /* states z (states.c) */
    double *z;                        /* [n_z] now */
    double *Z, *H;                    /* [s x n_z] stage values, rates */
    double *offset, *dz;              /* [s x n_z] */
    double *by_K;                     /* [s n_z x s n_q] */
    double *wide_K, *wide_H, *wide_Z; /* [s n_q x columns], [s n_z x columns] twice */
    double *before;                   /* [3 x pad] a, a_a, a_e before a step of the activations */
};

/* Stage activations and their derivatives for the mechanical step [0, h]; moves a, a_a, a_e to its
 * end. [hot] */
mhe_status rk_activations(struct rk_context *c, const double *e, double h, int32_t derivatives,
                          mhe_error *err);
/* The weights that it needs, once. [cold] */
void rk_activation_weights(struct rk_context *c);

/* Solves the stages of one step of length h with the stage activations as they are; with
 * `derivatives` also what rk_advance needs of them. [hot] */
mhe_status rk_mechanics(struct rk_context *c, const double *r, double h, int32_t derivatives,
                        mhe_error *err);

/* Moves q, v, and with `derivatives` also `sens`, over the step just solved. [hot] */
mhe_status rk_advance(struct rk_context *c, double h, int32_t derivatives, mhe_error *err);

/* The interval in n steps of length h, halved where they have no solution or err by more than the
 * tolerance (refine.c). [hot] */
mhe_status rk_steps(struct rk_context *c, const double *u, int32_t n, double h, int32_t derivatives,
                    mhe_error *err);

/* The probes of a collocation scheme. */
void rk_tableau_probes(const struct rk_tableau *t, struct rk_probe out[RK_PROBES]);
void rk_tests(const struct rk_tableau *t, const struct rk_probe *probes, struct rk_test *out);

/* The system's accelerations at a point with the inputs of the interval. [hot] */
mhe_status rk_accelerate(const struct rk_context *c, const double *q, const double *v,
                         const double *a, const double *z, const double *r,
                         const mhe_acceleration *out, mhe_error *err);

/* Parts of mechanics.c that start.c uses: position and velocity of stage j -> c->stage_q, stage_v;
 * LU of I - h^2 (A A) f_q - h A f_v, where `only` is the stage whose derivatives serve all, -1:
 * each its own; and the solution of J x = residual added to K (and Z, behind rk_states_before): its
 * size as a velocity, in units of 1 + |v|, NaN where it has none. [hot] */
void rk_stage(struct rk_context *c, double h, int32_t j);
mhe_status rk_factor(struct rk_context *c, double h, int32_t only, mhe_error *err);
double rk_correct(struct rk_context *c, double h);

/* Where the iterations of a step begin (start.c). [hot] */

/* Stage accelerations of the system linearised at the start of the step, from one evaluation there;
 * leaves its Jacobian factored. */
mhe_status rk_predict(struct rk_context *c, const double *r, double h, mhe_error *err);
/* With states z: the acceleration at the start for all stages, and z itself. */
mhe_status rk_predict_states(struct rk_context *c, const double *r, mhe_error *err);
/* Stage accelerations from those of the last step of this length that was linearised here: to first
 * order in what its data have changed by. Returns the size of the move, NaN: nothing is known. */
double rk_recall(struct rk_context *c, const double *r, double h);
/* Keeps the step just linearised. */
void rk_keep(const struct rk_context *c, const double *r, double h);

/* Right after the evaluation at the start of a step (f, f_a of stage 0): keeps f at the first
 * probe. [hot] */
void rk_keep_start(struct rk_context *c);

/* Chains the derivatives of the step just solved onto `sens`. [hot] */
void rk_chain(struct rk_context *c, double h);

/* memory.c: sizes of the memory of an interval, from system, tableaus and config; doubles of a slot
 * and a trace, and their arrays in a block of so many. */
void rk_memory_layout(struct rk *rk);
int32_t rk_slot_size(const struct rk *rk);
int32_t rk_trace_size(const struct rk *rk);
void rk_slot_at(const struct rk *rk, double *memory, struct rk_slot *out);
void rk_trace_at(const struct rk *rk, double *memory, struct rk_trace *out);
/* The slot of the present step, the trace of its k-th activation step; 0: none is kept. [hot] */
int rk_memory_slot(const struct rk_context *c, struct rk_slot *out);
int rk_memory_trace(const struct rk_context *c, int32_t k, struct rk_trace *out);

/* states.c. rk_states_factor: behind the derivatives at the stages and the equations without z in
 * `lu`: P and E, and what z adds to `lu`; 0: singular. rk_states_offset: what Z is off by.
 * rk_states_before and _after: around the solution for K, residual to dK; the latter moves Z and
 * returns the size of that. rk_states_recall: Z of the slot in use, and before() what moves it from
 * there. [hot] */
int rk_states_factor(struct rk_context *c, double h);
void rk_states_offset(struct rk_context *c, double h);
void rk_states_before(struct rk_context *c);
double rk_states_after(struct rk_context *c);
void rk_states_recall(struct rk_context *c, double h);
void rk_states_keep(const struct rk_context *c);
void rk_states_chain(struct rk_context *c, double h);
int rk_states_advance(struct rk_context *c);

/* product.c: C [m x n] = A^T B (`set`) or += A^T B with A [k x m], B [k x n]; row-major with rows
 * of ld doubles. */
void rk_product(int32_t m, int32_t n, int set, int32_t k, const double *A, int32_t ld_a,
                const double *B, int32_t ld_b, double *C, int32_t ld_c);

/* lu.c: a [n x n] row-major becomes its LU factors (0: singular); x [n] = A^-1 x; x [n x m],
 * row-major, = A^-1 x, = A^-T x. */
int rk_lu_factor(double *a, int32_t n, int32_t *pivots);
void rk_lu_solve(const double *lu, int32_t n, const int32_t *pivots, double *x);
void rk_lu_solve_columns(const double *lu, int32_t n, const int32_t *pivots, double *x, int32_t m);
void rk_lu_solve_transposed(const double *lu, int32_t n, const int32_t *pivots, double *x,
                            int32_t m);

extern const mhe_integrator_ops rk_ops;

#endif
