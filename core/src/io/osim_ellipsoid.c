/* SPDX-License-Identifier: Apache-2.0 */
/* osim_ellipsoid.c: joints whose origin slides on an ellipsoid.
 *
 * With body-fixed x-y-z angles a, b, c the child's z axis is n = (sin b, -sin a cos b, cos a cos b)
 * in the parent, and its origin is at (r_x n_x, r_y n_y, r_z n_z). Each part is a sum of points on
 * circles, and a point on a circle is a turn and a fixed step, so the whole is a chain of turns,
 * exact with all its derivatives:
 *     y, z: (r_z + r_y) / 4 along z turned about x by a + b and by a - b,
 *           (r_z - r_y) / 4 along z turned about x by b - a and by -a - b;
 *     x:    r_x / 2 along z turned about y by b, and against z turned about y by -b.
 * A sphere needs r along z after the turns a, b alone. */
#include "io/osim.h"

#include <math.h>
#include <string.h>

static const double axis_x[3] = {1, 0, 0}, axis_y[3] = {0, 1, 0}, axis_z[3] = {0, 0, 1};

static void turn(mhi_osim *o, mhi_osim_joint *j, int32_t i, const double axis[3], double factor) {
    if (o->b.status == MHE_OK) {
        mhi_build_motion(&o->b, j->body, MHE_MOTION_ROTATION, j->first + i, axis,
                         mhi_function_polynomial(&o->b, (const double[2]){0, factor}, 2),
                         mhi_xml_line(j->node));
    }
}

/* A constant step or turn; a length or angle of 0 is left out. */
static void fixed(mhi_osim *o, mhi_osim_joint *j, int32_t kind, const double axis[3],
                  double amount) {
    if (o->b.status == MHE_OK) {
        mhi_build_motion(&o->b, j->body, kind, -1, axis, mhi_function_constant(&o->b, amount),
                         mhi_xml_line(j->node));
    }
}

static void step(mhi_osim *o, mhi_osim_joint *j, const double axis[3], double length) {
    fixed(o, j, MHE_MOTION_TRANSLATION, axis, length);
}

/* The slide of the origin; coordinates 0 and 1 of the joint are a and b. */
static void slide(mhi_osim *o, mhi_osim_joint *j, const double radii[3]) {
    double sum = (radii[2] + radii[1]) / 4, difference = (radii[2] - radii[1]) / 4;
    turn(o, j, 0, axis_x, 1);
    turn(o, j, 1, axis_x, 1);
    step(o, j, axis_z, sum);
    turn(o, j, 1, axis_x, -2);
    step(o, j, axis_z, sum);
    if (difference != 0) {
        turn(o, j, 0, axis_x, -2);
        turn(o, j, 1, axis_x, 2);
        step(o, j, axis_z, difference);
        turn(o, j, 1, axis_x, -2);
        step(o, j, axis_z, difference);
        turn(o, j, 0, axis_x, 1);
    } else {
        turn(o, j, 0, axis_x, -1);
    }
    turn(o, j, 1, axis_x, 1); /* back to no turn at all */
    turn(o, j, 1, axis_y, 1);
    step(o, j, axis_z, radii[0] / 2);
    turn(o, j, 1, axis_y, -2);
    step(o, j, axis_z, -radii[0] / 2);
    turn(o, j, 1, axis_y, 1);
}

static void ellipsoid(mhi_osim *o, mhi_osim_joint *j, const double radii[3]) {
    int32_t sphere = radii[0] == radii[1] && radii[1] == radii[2];
    if (!sphere) {
        slide(o, j, radii);
    }
    mhi_osim_motion(o, j, MHE_MOTION_ROTATION, 0, axis_x);
    mhi_osim_motion(o, j, MHE_MOTION_ROTATION, 1, axis_y);
    if (sphere) {
        step(o, j, axis_z, radii[0]);
    }
    mhi_osim_motion(o, j, MHE_MOTION_ROTATION, 2, axis_z);
}

void mhi_osim_ellipsoid_joint(mhi_osim *o, mhi_osim_joint *j) {
    double radii[3] = {1, 1, 1};
    (void)mhi_xml_numbers(o, j->node, "radii_x_y_z", radii, 3);
    mhi_osim_coordinates(o, j, 3);
    ellipsoid(o, j, radii);
}

/* The scapula on the thorax (Seth et al. 2016, doi:10.1371/journal.pone.0141028): an ellipsoid
 * turned by 90 degrees about z, so that abduction and elevation are positive, then winging about an
 * axis in the scapula's plane. */
void mhi_osim_scapulothoracic_joint(mhi_osim *o, mhi_osim_joint *j) {
    double radii[3] = {1, 1, 1}, origin[2] = {0, 0}, direction = 0;
    const double quarter = acos(0);
    (void)mhi_xml_numbers(o, j->node, "thoracic_ellipsoid_radii_x_y_z", radii, 3);
    (void)mhi_xml_numbers(o, j->node, "scapula_winging_axis_origin", origin, 2);
    (void)mhi_xml_numbers(o, j->node, "scapula_winging_axis_direction", &direction, 1);
    const double turned[3] = {radii[1], radii[0], radii[2]};
    const double axis[3] = {-sin(direction), cos(direction), 0};
    mhi_osim_coordinates(o, j, 4);
    fixed(o, j, MHE_MOTION_ROTATION, axis_z, quarter);
    ellipsoid(o, j, turned);
    fixed(o, j, MHE_MOTION_ROTATION, axis_z, -quarter);
    step(o, j, axis_x, origin[0]);
    step(o, j, axis_y, origin[1]);
    mhi_osim_motion(o, j, MHE_MOTION_ROTATION, 3, axis);
    step(o, j, axis_x, -origin[0]);
    step(o, j, axis_y, -origin[1]);
}
