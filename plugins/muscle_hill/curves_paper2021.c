/* SPDX-License-Identifier: Apache-2.0 */
/* curves_paper2021.c: what Bailly et al. (2021), doi:10.3389/fbioe.2021.642742, ran.
 *
 * Pennation at constant angle, n = (L - l_slack) / (cos(alpha) l_opt), no cos(alpha) on the force.
 * s is the musculotendon velocity over 10 m/s, whatever the optimal length and the angle. Two
 * types: "hillthelen" where the file says Thelen, else "hill".
 *
 * Kinks: fv at s = 0, slope of shortening taken there; fp switches on where the *fibre* length
 * passes the tendon slack length (a jump, unless passive_ramp spreads it; the slopes are those of
 * either side).
 *
 * An idle muscle that shortens pushes: the damping acts beside the fibre and is not cut off, up to
 * 0.1 F_max at 10 optimal lengths per second; below s = -1 fv is negative too. So the paper ran it.
 */
#include "hill.h"
#include "shapes.h"

#define PAPER_SPEED 0.1   /* 1 / (10 m/s) */
#define PAPER_DAMPING 0.1 /* of F_max at 10 optimal lengths per second */

/* Off up to the switch; with a ramp it rises over the lengths before it, and is what it was from
 * there on. */
static struct hill_shape paper_passive(const struct hill_muscle *muscle, double n, double offset) {
    const double from = muscle->passive_from, ramp = muscle->passive_ramp;
    if (!(n > from - ramp)) {
        return (struct hill_shape){0, 0};
    }
    struct hill_shape fp = hill_exponential(n, 10, offset, muscle->passive_scale);
    if (n <= from) {
        const struct hill_shape part = hill_rise((n - from) / ramp + 1);
        fp.slope = part.value * fp.slope + part.slope / ramp * fp.value;
        fp.value *= part.value;
    }
    return fp;
}

/* By where it switches on; what jumps there has the slope of either side, 0. */
static double paper_passive_by(const struct hill_muscle *muscle, double n, double offset) {
    const double from = muscle->passive_from, ramp = muscle->passive_ramp;
    if (!(n > from - ramp) || n > from) {
        return 0;
    }
    return -hill_rise((n - from) / ramp + 1).slope / ramp *
           hill_exponential(n, 10, offset, muscle->passive_scale).value;
}

static double paper_hill_by(const struct hill_muscle *muscle, double n) {
    return paper_passive_by(muscle, n, 0);
}

static double paper_hill_thelen_by(const struct hill_muscle *muscle, double n) {
    return paper_passive_by(muscle, n, 1);
}

static void paper_hill(const struct hill_muscle *muscle, double a, double n, double s,
                       struct hill_value *out) {
    double fl_a;
    struct hill_shape fl = hill_moving_bell(a, n, &fl_a);
    hill_total(a, fl, fl_a, hill_hyperbola(s), paper_passive(muscle, n, 0), out);
}

static void paper_hill_thelen(const struct hill_muscle *muscle, double a, double n, double s,
                              struct hill_value *out) {
    hill_total(a, hill_bell(n, 0.45), 0, hill_hyperbola(s), paper_passive(muscle, n, 1), out);
}

static int paper_says_thelen(const mhe_muscle *muscle) {
    return muscle->type == MHE_MUSCLE_HILL_THELEN || muscle->type == MHE_MUSCLE_THELEN2003;
}

static void paper_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                          struct hill_muscle *out) {
    int thelen = paper_says_thelen(muscle);
    out->curve = thelen ? paper_hill_thelen : paper_hill;
    out->many = thelen ? HILL_MANY_NONE : HILL_MANY_PAPER;
    out->inv_cos = 1 / cos(hill_or(muscle->pennation_angle, 0));
    out->pull = 1;
    out->speed = PAPER_SPEED;
    out->damping = PAPER_DAMPING * out->inverse;
    out->damping_o = -out->damping * out->inverse;
    out->passive_by = thelen ? paper_hill_thelen_by : paper_hill_by;
    out->passive_from = out->l_slack * out->inverse;
    out->passive_ramp = config->passive_ramp;
    out->passive_scale = thelen ? 1 / expm1(5) : exp(-5);
}

const struct hill_curve_set hill_paper2021 = {
    .name = "paper2021", .jumps = 1, .prepare = paper_prepare};
