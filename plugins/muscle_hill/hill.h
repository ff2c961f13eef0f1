/* SPDX-License-Identifier: Apache-2.0 */
/* hill.h: one Hill muscle, and the curve sets it can run on. Of its tendon: elastic.h.
 *
 * Symbols follow muscle-curve literature: n fibre length over optimal fibre length, s normalised
 * fibre velocity (lengthening positive; each set says by what it is divided), fl active
 * force-length, fv force-velocity, fp passive. A muscle's force is
 *     F = f_max (a fl fv + fp + damping s) pull
 * where `pull` is the share of the fibre force along the tendon. */
#ifndef MUSCLE_HILL_H
#define MUSCLE_HILL_H

#include <mhe/muscle.h>

/* Filled by the core from the option table in plugin.c. */
struct hill_config {
    int32_t curves;   /* position in hill_curve_sets */
    double tau_act;   /* s; 0: the file's, else 0.010 */
    double tau_deact; /* s; 0: the file's, else 0.040 */
    double activation_smoothing;
    double damping;      /* below 0: the file's, else 0 */
    double vmax;         /* optimal lengths per second; 0: the file's, else 10 */
    double passive;      /* factor of the passive force */
    double passive_ramp; /* n below a jump of the passive force over which it grows; 0: a jump */
    int32_t tendon;      /* HILL_RIGID, HILL_ELASTIC, HILL_FILE */
};

#define HILL_RIGID 0
#define HILL_ELASTIC 1
#define HILL_FILE 2 /* elastic but where the file says to ignore it */

#define HILL_ACTIVATION 0 /* the states */
#define HILL_FIBER 1

/* a fl fv + fp and its derivatives by a, n and s. */
struct hill_value {
    double f, f_a, f_n, f_s;
};

struct hill_muscle;
struct hill_shape;
struct hill_millard;
struct hill_file;
typedef void (*hill_curve)(const struct hill_muscle *muscle, double a, double n, double s,
                           struct hill_value *out);

/* The same curve by curve, for elastic tendons: fl and fp by n; fv by s, with its derivative by
 * activation; the tendon's force in F_max by its length over the slack length. */
typedef void (*hill_lengths)(const struct hill_muscle *muscle, double n, struct hill_shape *fl,
                             struct hill_shape *fp);
typedef struct hill_shape (*hill_speeds)(const struct hill_muscle *muscle, double a, double s,
                                         double *by_a);
/* The s with gain fv(s) + beta s = sum; fv there. */
typedef struct hill_shape (*hill_balance)(const struct hill_muscle *muscle, double gain, double sum,
                                          double *s);
typedef struct hill_shape (*hill_tendon)(const struct hill_muscle *muscle, double x);

/* Curves that are also there for several muscles side by side (many.c). */
#define HILL_MANY_NONE 0
#define HILL_MANY_PAPER 1 /* the type `hill` of paper2021 */
#define HILL_MANY_DEGROOTE 2

struct hill_muscle {
    hill_curve curve;
    int32_t many;   /* HILL_MANY_* */
    double f_max;   /* N */
    double l_slack; /* m */
    double inverse; /* n per metre of fibre: 1 / l_opt */
    double speed;   /* s per m/s of fibre velocity */
    double damping; /* f_max per unit of s */
    double speed_o; /* by l_opt: of `speed`, of `damping` */
    double damping_o;
    double (*passive_by)(const struct hill_muscle *, double n); /* fp by passive_from, which is
                                                                 * l_slack / l_opt; NULL: 0 */
    double pull;    /* constant angle: share of the fibre force along the tendon */
    double inv_cos; /* constant angle: 1 / cos(pennation) */
    double height;  /* constant thickness: l_opt sin(pennation), m; 0: constant angle */
    /* shapes of the passive and active curves, where a set has them to choose */
    double passive_from;                /* n above which fp acts */
    double passive_ramp;                /* n below it over which fp grows from 0 */
    double passive_rate;                /* exponent per unit of n */
    double passive_offset;              /* taken off the exponential */
    double passive_scale;               /* 1 / (exp(k_PE) - 1) or the like */
    double active_width;                /* Thelen gamma */
    double concentric;                  /* 1 / A_f */
    double eccentric;                   /* (2 + 2 / A_f) / (F_len - 1) */
    double eccentric_max;               /* F_len */
    const struct hill_millard *millard; /* that set only */
    const struct hill_file *file;       /* that set only */
    /* an elastic tendon, see elastic.h; lengths is NULL where the set has none */
    hill_lengths lengths;
    hill_speeds speeds;
    hill_balance balance; /* NULL: by iteration on `speeds` */
    hill_tendon tendon;
    int32_t elastic;                              /* whether this muscle's is */
    double l_opt;                                 /* m */
    double vmax;                                  /* 1/s */
    double sine;                                  /* of the pennation at optimal length */
    double shortest;                              /* z of the shortest fibre */
    double beta;                                  /* damping */
    double tendon_inverse;                        /* 1 / l_slack, 1/m */
    double tendon_zero;                           /* x up to which it is slack */
    double tendon_rate;                           /* exponent per unit of x */
    double tendon_scale, tendon_toe, tendon_line; /* see the sets */
};

/* A curve set. `prepare` fills everything of `out` that the curves decide, from a checked
 * description and the overrides of `config`; f_max, l_slack and inverse are already there. */
struct hill_curve_set {
    const char *name;
    int32_t published; /* takes the overrides `damping` and `vmax` */
    int32_t jumps;     /* its passive force does, and takes `passive_ramp` */
    int32_t millard;   /* needs hill_muscle.millard, which is there before prepare */
    int32_t file;      /* needs hill_muscle.file likewise */
    void (*prepare)(const mhe_muscle *muscle, const struct hill_config *config,
                    struct hill_muscle *out);
};

extern const struct hill_curve_set hill_paper2021, hill_biorbd, hill_degroote2016, hill_thelen2003,
    hill_millard2012, hill_file;

/* Curves that stand in the model file, with the muscle's type (Schutte 1993, RigidTendonMuscle). */
struct hill_file {
    int32_t type;
    mhe_function active, passive, tendon, velocity;
};

/* Order of the choices of the option `curves`. */
extern const struct hill_curve_set *const hill_curve_sets[];
#define HILL_CURVE_CHOICES "auto|paper2021|biorbd|degroote2016|thelen2003|millard2012|file"

/* An instance: the muscles in the order of the model. */
struct hill {
    int32_t n, n_states;          /* 2 where a tendon is elastic */
    double smoothing;             /* b of the activation dynamics */
    double *rate_act;             /* 1 / tau_act, 1/s [n] */
    double *rate_deact;           /* 1 / tau_deact, 1/s [n] */
    struct hill_muscle *m;        /* [n] */
    struct hill_millard *millard; /* [n], those of that set filled; NULL: none is */
    struct hill_file *file;       /* likewise */
    double *columns;              /* [HILL_COLUMNS x n] of many.c */
    double *lower, *upper;        /* [n_states x n] */
    uint8_t *present;             /* [n_states x n] */
};

/* parameters.c: derivatives by max_isometric_force, optimal_fiber_length, tendon_slack_length: how
 * many. Fills out->force_p and out->rate_p. */
int32_t hill_parameters(const char *const **names);
void hill_by_parameters(const struct hill *hill, const mhe_muscle_point *at,
                        const mhe_muscle_values *out);

/* Columns of hill->columns, of the fields of that name. */
enum {
    HILL_F_MAX,
    HILL_L_SLACK,
    HILL_INVERSE,
    HILL_SPEED,
    HILL_DAMPING,
    HILL_PULL,
    HILL_INV_COS,
    HILL_HEIGHT,
    HILL_PASSIVE_FROM,
    HILL_PASSIVE_RAMP,
    HILL_PASSIVE_RATE,
    HILL_PASSIVE_OFFSET,
    HILL_PASSIVE_SCALE,
    HILL_COLUMNS
};
struct hill_columns {
    const double *at[HILL_COLUMNS]; /* of the first muscle of a chunk */
};

/* many.c: fills hill->columns, the muscles being there; MHE_E_MEMORY. Forces of muscle `from` and
 * those after it that are on the same curves; returns the first that is not done: `from` where they
 * are not, or where only some of the derivatives are asked for. */
mhe_status hill_make_columns(struct hill *hill);
int32_t hill_forces_of_many(const struct hill *hill, int32_t from, const mhe_muscle_point *at,
                            const mhe_muscle_values *out);

/* curves_degroote2016.c: its constants, see hill_three_bells and hill_log_velocity. */
extern const double hill_degroote_bells[3][4], hill_degroote_velocity[4];

/* The fibre of a muscle with a rigid tendon at a musculotendon length and velocity. */
struct hill_fibre {
    double n, n_l;       /* normalised length, its slope by L */
    double s, s_l, s_w;  /* normalised velocity, its slopes by L and Ldot */
    double pull, pull_l; /* share of the fibre force along the tendon */
};
void hill_fibre_at(const struct hill_muscle *m, double l, double w, struct hill_fibre *fibre);

extern const mhe_muscle_ops hill_ops;
mhe_status hill_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                       const void *config, void **self, mhe_error *err);
void hill_destroy(void *self);

/* `stated`, or `otherwise` where the file says nothing (NaN). */
double hill_or(double stated, double otherwise);

/* Pennation of a published set: constant muscle thickness, velocity in vmax. */
void hill_published_geometry(const mhe_muscle *muscle, const struct hill_config *config,
                             struct hill_muscle *out);

#endif
