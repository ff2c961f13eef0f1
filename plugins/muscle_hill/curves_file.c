/* SPDX-License-Identifier: Apache-2.0 */
/* curves_file.c: muscles whose curves stand in the model file.
 *
 * Schutte et al. (1993), doi:10.1109/86.242418, as OpenSim's Schutte1993Muscle_Deprecated has it:
 * fl, at least 0, fp and the tendon's curve of strain are functions of the file, fp exp(8 (n - 1) -
 * 4) where it states none. Its fibre velocity solves, x = a fl, s in optimal lengths per time
 * scale, F = x fv(s) + damping s:   fv = (1 + s) / (1 - s / 0.15) in -1 .. 0, 0 below, fv = (1
 * + 1.4 k s) / (1 + k s) above 0, k = 1.15 / (0.13 0.15). RigidTendonMuscle: fl, fp and fv are
 * functions of the file (fv 1 where it states none).
 *
 * Without `damping` no force is negative unless a function of the file is.
 *
 * Kinks: where fl is cut off at 0, and fv at 0 (slope of shortening) and -1. Pennation at constant
 * thickness. */
#include "elastic.h"
#include "hill.h"
#include "shapes.h"

#include "../coordinate.h"

static struct hill_shape file_function(const mhe_function *f, double at) {
    double out[3];
    coordinate_function(f, at, out);
    return (struct hill_shape){out[0], out[1]};
}

static struct hill_shape file_velocity(const struct hill_file *file, double s) {
    const double curvature = 0.15, limit = 1.4, k = (1 + curvature) / (0.13 * curvature);
    if (file->type != MHE_MUSCLE_SCHUTTE1993) {
        return file->velocity.n_pieces > 0 ? file_function(&file->velocity, s)
                                           : (struct hill_shape){1, 0};
    }
    if (s > 0) {
        double under = 1 / (1 + k * s);
        return (struct hill_shape){(1 + k * limit * s) * under, k * (limit - 1) * under * under};
    }
    if (s < -1) {
        return (struct hill_shape){0, 0};
    }
    double under = 1 / (1 - s / curvature);
    return (struct hill_shape){(1 + s) * under, (1 + 1 / curvature) * under * under};
}

static void file_lengths(const struct hill_muscle *muscle, double n, struct hill_shape *fl,
                         struct hill_shape *fp) {
    const struct hill_file *file = muscle->file;
    *fl = file_function(&file->active, n);
    if (fl->value < 0) {
        *fl = (struct hill_shape){0, 0};
    }
    *fp = file->passive.n_pieces > 0 ? file_function(&file->passive, n)
                                     : hill_exponential(n, 8, 0, exp(-4));
    fp->value *= muscle->passive_scale;
    fp->slope *= muscle->passive_scale;
}

static struct hill_shape file_speeds(const struct hill_muscle *muscle, double a, double s,
                                     double *by_a) {
    (void)a;
    *by_a = 0;
    return file_velocity(muscle->file, s);
}

static void file_curve(const struct hill_muscle *muscle, double a, double n, double s,
                       struct hill_value *out) {
    struct hill_shape fl, fp;
    file_lengths(muscle, n, &fl, &fp);
    hill_total(a, fl, 0, file_velocity(muscle->file, s), fp, out);
}

static struct hill_shape file_tendon(const struct hill_muscle *muscle, double x) {
    if (!(x > 1)) {
        return (struct hill_shape){0 * x, 0}; /* NaN gives NaN */
    }
    return file_function(&muscle->file->tendon, x - 1);
}

static void file_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                         struct hill_muscle *out) {
    hill_published_geometry(muscle, config, out);
    out->curve = file_curve;
    out->passive_scale = 1;
    out->lengths = file_lengths;
    out->speeds = file_speeds;
    out->tendon = out->file->tendon.n_pieces > 0 ? file_tendon : NULL; /* NULL: it is rigid */
    out->tendon_zero = 1;
    hill_elastic_prepare(muscle, 0, out);
}

const struct hill_curve_set hill_file = {
    .name = "file", .published = 1, .file = 1, .prepare = file_prepare};
