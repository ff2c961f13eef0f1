/* SPDX-License-Identifier: Apache-2.0 */
/* force.h: interface of force plugins (kind "force"): what acts on the skeleton beside muscles and
 * residual torques.
 *
 * A force plugin acts in up to four ways, each with its derivatives, and the core brings them into
 * the equation of motion and its derivatives:
 *   - a generalised force tau [n_q] from q, qdot and its inputs (coordinate limits, springs);
 *   - tensions along paths of the model, from their lengths and velocities (ligaments, springs);
 *   - pushes between pairs of frames on bodies, from how they stand to each other (bushings);
 *   - loads on bodies: a force at a point and a torque, from its inputs (ground reaction, a weight
 * in the hand). The frames that a load is given in are constant; how it turns into generalised
 *     force is the model's affair.
 * Inputs are numbers known at every node (measured, recorded): a block of the system's layout that
 * has the plugin's name. They come from a file that the configuration names, or frame by frame. */
#ifndef MHE_FORCE_H
#define MHE_FORCE_H

#include <mhe/description.h>
#include <mhe/model.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_FORCE_IFACE "mhe.force/1"

/* Two frames on bodies (-1: ground), each (r, p) in its body. How frame 2 stands in frame 1 are six
 * numbers, its deflection: body-fixed x-y-z angles (rad), then the place of its origin (m). Where
 * the second angle is at +-pi/2 there is no value (MHE_RETRY). */
typedef struct mhe_frame_pair {
    int32_t body[2];
    double r[2][9], p[2][3];
} mhe_frame_pair;

/* Filled by layout(); zeroed before. Strings and arrays live as long as the instance. */
typedef struct mhe_force_layout {
    uint32_t size;
    const char *name;               /* of its blocks and in results; NULL: the plugin's id */
    int32_t generalised;            /* 1: gives tau */
    int32_t n_inputs;               /* n_w */
    const char *const *input_names; /* [n_w] */
    const char *const *input_units; /* [n_w] */
    int32_t n_paths;                /* n_t tensions */
    const int32_t *paths;           /* [n_t] numbers of the description's paths */
    int32_t n_loads;                /* n_l */
    const mhe_load *loads;          /* [n_l] bodies and frames */
    int32_t n_parameters;           /* n_p by which derivatives can be had */
    const char *const *parameter_names;
    int32_t n_pairs;             /* n_f */
    const mhe_frame_pair *pairs; /* [n_f] */
} mhe_force_layout;

/* Where to evaluate. Lent for the call. */
typedef struct mhe_force_point {
    uint32_t size;
    const double *q, *v;             /* [n_q] */
    const double *length, *velocity; /* of its paths [n_t] */
    const double *input;             /* [n_w] */
    const double *deflection;        /* of its pairs [n_f x 6] */
    const double *deflection_rate;   /* [n_f x 6] */
} mhe_force_point;

/* What is wanted; NULL: not. All zeroed by the core before the call. Row-major. */
typedef struct mhe_force_values {
    uint32_t size;
    double *tau;       /* [n_q], N m (N); only where layout->generalised */
    double *tau_q;     /* [n_q x n_q] */
    double *tau_v;     /* [n_q x n_q] */
    double *tau_w;     /* [n_q x n_w] */
    double *tau_p;     /* [n_q x n_p] */
    double *tension;   /* [n_t], N, positive = pull */
    double *tension_l; /* [n_t], N/m */
    double *tension_w; /* [n_t] by its velocity, N s/m */
    double *tension_p; /* [n_t x n_p] */
    double *load;      /* [n_l x 9]: force N, point m, torque N m, each 3, see mhe_load */
    double *load_w;    /* [9 n_l x n_w] */
    double *push;      /* [n_f x 6] N m, N: the work-conjugate of each pair's deflection */
    double *push_d;    /* [n_f x 6 x 6] by its own pair's deflection */
    double *push_w;    /* [n_f x 6 x 6] by that one's rate */
} mhe_force_values;

typedef struct mhe_force_ops {
    uint32_t size;
    /* `description` lives until after destroy(). [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_description *description,
                         const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self);                                                   /* [cold] */
    mhe_status (*layout)(const void *self, mhe_force_layout *out, mhe_error *err); /* [cold] */
    /* MHE_RETRY: no value here, as where an input is NaN and the force cannot do without. A result
     * that is not finite is taken for MHE_RETRY. [hot] */
    mhe_status (*evaluate)(const void *self, const mhe_force_point *at, const mhe_force_values *out,
                           mhe_error *err);
    /* For plugins whose inputs stand in a file: their values [n_w] at time t (s), NaN where the
     * file has none; and the times that it covers. Both NULL: inputs come with the frames. Over an
     * interval the inputs of its middle hold; those that come with frames, of its first node.
     * input() is [hot], covers() [cold]. */
    mhe_status (*input)(const void *self, double t, double *w, mhe_error *err);
    mhe_status (*covers)(const void *self, double *first, double *last, mhe_error *err);
} mhe_force_ops;

/* Service of the host (mhe_host.service) for force plugins: OpenSim's ExternalLoads, read. */
#define MHE_EXTERNAL_LOADS_SERVICE "mhe.external-loads/1"

/* What a file of loads says, on its own times. */
typedef struct mhe_external_loads {
    uint32_t size;
    int32_t n_loads, n_rows;
    const char *const *names; /* [n_loads] */
    const mhe_load *loads;    /* [n_loads] */
    const double *time;       /* [n_rows], s, increasing */
    const double *values;     /* [n_rows x n_loads x 9] force N, point m, torque N m; finite */
} mhe_external_loads;

typedef struct mhe_external_loads_service {
    uint32_t size;
    /* Reads an ExternalLoads .xml and the .mot or .sto that it names, for the bodies of
     * `description`. Loads that are switched off are left out. MHE_E_INPUT: "file:line: what": not
     * readable, an unknown body, a missing column, a missing value. [cold] */
    mhe_status (*read)(const char *path, const mhe_description *description,
                       const mhe_external_loads **loads, mhe_error *err);
    void (*free)(const mhe_external_loads *loads); /* NULL is fine. [cold] */
} mhe_external_loads_service;

#ifdef __cplusplus
}
#endif
#endif
