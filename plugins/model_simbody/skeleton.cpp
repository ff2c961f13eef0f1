/* SPDX-License-Identifier: Apache-2.0 */
/* skeleton.cpp: the one file that knows Simbody. */
/* Simbody's classes have other members under NDEBUG. Debian's libraries are built without it, so
 * this file is too, in every build type. */
#undef NDEBUG

#include "skeleton.h"

#include <Simbody.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <vector>

using namespace SimTK;

/* A loop of the description as a constraint, with its frames on the links. */
struct closure {
    Constraint constraint;
    MobilizedBody body[2];
    Transform frame[2];
    bool weld;
};

struct skeleton {
    const tree *source;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    std::vector<MobilizedBody> links;
    std::vector<closure> loops;
    std::vector<double> excess; /* of the links' inertias, see inertia_excess() */
    bool any_excess = false;
    std::vector<int> q, u; /* Simbody's numbers of the joints */
    State state;
    Vector none, acceleration, torque, loop_error;
    Vector_<SpatialVec> weight; /* gravity on each body, filled at the pose */
    Vector_<SpatialVec> motion; /* accelerations of the bodies */
    Matrix mass;

    explicit skeleton(const tree *from) : source(from), matter(system) {}
};

namespace {

/* Runs `work`; no exception may leave into C. */
template <typename Work> mhe_status guarded(mhe_error *err, Work work) noexcept {
    try {
        work();
        return MHE_OK;
    } catch (const std::bad_alloc &) {
        return mhe_fail(err, MHE_E_MEMORY, "Simbody ran out of memory");
    } catch (const std::exception &e) {
        return mhe_fail(err, MHE_E_NUMERIC, "Simbody: %s", e.what());
    } catch (...) {
        return mhe_fail(err, MHE_E_INTERNAL, "Simbody threw something unknown");
    }
}

Mat33 matrix(const double *r) {
    return Mat33(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]);
}

Vec3 vector(const double *p) {
    return Vec3(p[0], p[1], p[2]);
}

/* Simbody refuses inertias that no rigid body can have (triangle inequality), which files do hold.
 * Such a link gets this much more about every axis, and what that does is taken off again: about
 * every axis alike, it takes the torque excess times the angular acceleration, and nothing else. */
double inertia_excess(const tree_joint &link) {
    const double *i = link.inertia, sum = i[0] + i[4] + i[8];
    const double least = 2 * std::max(i[0], std::max(i[4], i[8])) - sum; /* > 0: it is broken */
    double products = 0;
    for (int k = 0; k < 9; k++) {
        products = std::max(products, k % 4 == 0 ? 0.0 : std::fabs(i[k]));
    }
    const double smallest = std::min(i[0], std::min(i[4], i[8]));
    return link.mass > 0 && (least > 0 || smallest < 2 * products || smallest <= 0)
               ? std::max(least, 0.0) + 2 * products + std::max(-smallest, 0.0) +
                     1e-3 * std::fabs(sum) + 1e-9
               : 0;
}

MassProperties mass_properties(const tree_joint &link, bool with_mass, double excess) {
    if (!with_mass || link.mass <= 0) {
        return MassProperties(0, Vec3(0), Inertia(0));
    }
    const double *i = link.inertia;
    Inertia central(i[0] + excess, i[4] + excess, i[8] + excess, i[1], i[2], i[5]);
    Vec3 com = vector(link.com);
    return MassProperties(link.mass, com, central.shiftFromMassCenter(-com, link.mass));
}

void add_link(skeleton &s, const tree_joint &joint, bool with_mass) {
    MobilizedBody &parent =
        joint.parent < 0 ? s.matter.updGround() : s.links[static_cast<size_t>(joint.parent)];
    /* the file's matrix as it is: Simbody would project a rounded one, and points of the same body
     * would then be placed by another matrix */
    Transform at(Rotation(matrix(joint.r), true), vector(joint.p));
    s.excess.push_back(with_mass ? inertia_excess(joint) : 0);
    s.any_excess = s.any_excess || s.excess.back() > 0;
    Body::Rigid body(mass_properties(joint, with_mass, s.excess.back()));
    if (joint.kind == MHE_MOTION_ROTATION) {
        s.links.push_back(MobilizedBody::Pin(parent, at, body, Transform()));
    } else {
        s.links.push_back(MobilizedBody::Slider(parent, at, body, Transform()));
    }
}

/* Where a frame of the description's body is: on which link, and how. */
void place_frame(skeleton &s, const mhe_loop &loop, int k, closure &out) {
    const Transform in_body(Rotation(matrix(loop.r[k]), true), vector(loop.p[k]));
    if (loop.body[k] < 0) {
        out.body[k] = s.matter.updGround();
        out.frame[k] = in_body;
        return;
    }
    const tree_place &at = s.source->bodies[loop.body[k]];
    out.body[k] = at.link < 0 ? static_cast<MobilizedBody &>(s.matter.updGround())
                              : s.links[static_cast<size_t>(at.link)];
    out.frame[k] = Transform(Rotation(matrix(at.r), true), vector(at.p)) * in_body;
}

void add_loop(skeleton &s, const mhe_loop &loop) {
    closure c;
    c.weld = loop.kind == MHE_LOOP_WELD;
    place_frame(s, loop, 0, c);
    place_frame(s, loop, 1, c);
    if (c.weld) {
        c.constraint = Constraint::Weld(c.body[0], c.frame[0], c.body[1], c.frame[1]);
    } else {
        c.constraint = Constraint::Ball(c.body[0], c.frame[0].p(), c.body[1], c.frame[1].p());
    }
    s.loops.push_back(c);
}

void build(skeleton &s, const mhe_description *description) {
    for (int32_t i = 0; i < s.source->n_joints; i++) {
        add_link(s, s.source->joints[i], description != nullptr);
    }
    for (int32_t i = 0; description != nullptr && i < description->n_loops; i++) {
        add_loop(s, description->loops[i]);
    }
    s.state = s.system.realizeTopology();
    s.system.realizeModel(s.state);
    for (const MobilizedBody &link : s.links) {
        s.q.push_back(static_cast<int>(link.getFirstQIndex(s.state)));
        s.u.push_back(static_cast<int>(link.getFirstUIndex(s.state)));
    }
    s.acceleration.resize(s.source->n_joints);
    s.torque.resize(s.source->n_joints);
    s.mass.resize(s.source->n_joints, s.source->n_joints);
    s.weight.resize(s.matter.getNumBodies());
    s.weight = SpatialVec(Vec3(0), Vec3(0));
    s.system.realize(s.state, Stage::Position);
}

void place(skeleton &s, const double *angle, double *r, double *p) {
    Vector &q = s.state.updQ(); /* invalidates what was computed before */
    for (size_t i = 0; i < s.links.size(); i++) {
        q[s.q[i]] = angle[i];
    }
    s.system.realize(s.state, Stage::Position);
    for (size_t i = 0; i < s.links.size(); i++) {
        const Transform &x = s.links[i].getBodyTransform(s.state);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++) {
                r[9 * i + 3 * static_cast<size_t>(row) + static_cast<size_t>(column)] =
                    x.R()[row][column];
            }
            p[3 * i + static_cast<size_t>(row)] = x.p()[row];
        }
    }
}

/* Joint i's axis in ground; 0 of a slider. */
Vec3 turning_axis(const skeleton &s, size_t i) {
    return s.source->joints[i].kind == MHE_MOTION_ROTATION
               ? Vec3(s.links[i].getBodyTransform(s.state).R().z())
               : Vec3(0);
}

/* Takes off the torques that the excess of inertia takes, at the state and accelerations. */
void take_off_torque(skeleton &s, double *torque) {
    s.matter.calcBodyAccelerationFromUDot(s.state, s.acceleration, s.motion);
    for (size_t l = 0; l < s.links.size(); l++) {
        const Vec3 moment =
            s.excess[l] * s.motion[static_cast<int>(s.links[l].getMobilizedBodyIndex())][0];
        for (int32_t i = static_cast<int32_t>(l); i >= 0 && s.excess[l] > 0;
             i = s.source->joints[i].parent) {
            torque[i] -= dot(turning_axis(s, static_cast<size_t>(i)), moment);
        }
    }
}

void take_off_mass(const skeleton &s, double *mass) {
    const size_t n = s.links.size();
    for (size_t l = 0; l < n; l++) {
        for (int32_t i = static_cast<int32_t>(l); i >= 0 && s.excess[l] > 0;
             i = s.source->joints[i].parent) {
            for (int32_t j = static_cast<int32_t>(l); j >= 0; j = s.source->joints[j].parent) {
                mass[n * static_cast<size_t>(i) + static_cast<size_t>(j)] -=
                    s.excess[l] * dot(turning_axis(s, static_cast<size_t>(i)),
                                      turning_axis(s, static_cast<size_t>(j)));
            }
        }
    }
}

void inverse(skeleton &s, const double *speed, const double *acceleration, double *torque) {
    Vector &u = s.state.updU();
    Vec3 gravity = vector(s.source->gravity);
    for (size_t i = 0; i < s.links.size(); i++) {
        u[s.u[i]] = speed[i];
        s.acceleration[s.u[i]] = acceleration[i];
        const tree_joint &link = s.source->joints[i];
        Vec3 arm = s.links[i].getBodyTransform(s.state).R() * vector(link.com);
        Vec3 force = link.mass * gravity;
        s.weight[static_cast<int>(s.links[i].getMobilizedBodyIndex())] =
            SpatialVec(arm % force, force);
    }
    s.system.realize(s.state, Stage::Velocity);
    s.matter.calcResidualForceIgnoringConstraints(s.state, s.none, s.weight, s.acceleration,
                                                  s.torque);
    for (size_t i = 0; i < s.links.size(); i++) {
        torque[i] = s.torque[s.u[i]];
    }
    if (s.any_excess) {
        take_off_torque(s, torque);
    }
}

void mass_matrix(skeleton &s, double *mass) {
    s.matter.calcM(s.state, s.mass);
    size_t n = s.links.size();
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            mass[n * i + j] = s.mass(s.u[i], s.u[j]);
        }
    }
    if (s.any_excess) {
        take_off_mass(s, mass);
    }
}

void set_speeds(skeleton &s, const double *speed) {
    Vector &u = s.state.updU();
    for (size_t i = 0; i < s.links.size(); i++) {
        u[s.u[i]] = speed[i];
    }
    s.system.realize(s.state, Stage::Velocity);
}

/* Simbody's rows of a loop, measured in the axes of the bodies' common ancestor, brought to ground.
 * A weld's come first those of its turning: of axes x, y, z of frame 2 with y, z, x of frame 1,
 * each the relative angular velocity along their cross product. */
void rows_to_ground(const skeleton &s, const closure &c, const Vector &simbody, double *out) {
    const Rotation &axes = c.constraint.getAncestorMobilizedBody().getBodyTransform(s.state).R();
    const int first = c.weld ? 3 : 0;
    const Vec3 point = axes * Vec3(simbody[first], simbody[first + 1], simbody[first + 2]);
    for (int i = 0; i < 3; i++) {
        out[i] = point[i];
    }
    if (c.weld) {
        const Rotation b = c.body[0].getBodyTransform(s.state).R() * c.frame[0].R();
        const Rotation f = c.body[1].getBodyTransform(s.state).R() * c.frame[1].R();
        const Mat33 normals(f.x() % b.y(), f.y() % b.z(), f.z() % b.x()); /* its columns */
        const Vec3 turning = ~normals.invert() * Vec3(simbody[0], simbody[1], simbody[2]);
        for (int i = 0; i < 3; i++) {
            out[3 + i] = turning[i];
        }
    }
}

void loop_gap(const skeleton &s, const closure &c, double *out) {
    Transform x[2];
    for (int k = 0; k < 2; k++) {
        x[k] = c.body[k].getBodyTransform(s.state) * c.frame[k];
    }
    Vec3 turning(0);
    for (int i = 0; i < 3; i++) {
        out[i] = x[1].p()[i] - x[0].p()[i];
        turning += 0.5 * (x[0].R().getAxisUnitVec(CoordinateAxis(i)) %
                          x[1].R().getAxisUnitVec(CoordinateAxis(i)));
    }
    for (int i = 0; i < 3 && c.weld; i++) {
        out[3 + i] = turning[i];
    }
}

void loops(skeleton &s, const double *speed, const double *acceleration, double *gap, double *rate,
           double *loop_acceleration) {
    set_speeds(s, speed);
    for (size_t i = 0; i < s.links.size(); i++) {
        s.acceleration[s.u[i]] = acceleration[i];
    }
    s.matter.calcConstraintAccelerationErrors(s.state, s.acceleration, s.loop_error);
    int row = 0;
    for (const closure &c : s.loops) {
        const int rows = c.weld ? 6 : 3;
        if (gap != nullptr) {
            loop_gap(s, c, gap + row);
        }
        if (rate != nullptr) {
            rows_to_ground(s, c, c.constraint.getVelocityErrorsAsVector(s.state), rate + row);
        }
        if (loop_acceleration != nullptr) {
            rows_to_ground(s, c, s.loop_error(row, rows), loop_acceleration + row);
        }
        row += rows;
    }
}

} // namespace

mhe_status skeleton_create(const tree *source, const mhe_description *description, skeleton **out,
                           mhe_error *err) {
    *out = nullptr;
    skeleton *made = nullptr;
    mhe_status status = guarded(err, [&] {
        made = new skeleton(source);
        build(*made, description);
    });
    if (status != MHE_OK) {
        if (status !=
            MHE_E_MEMORY) { /* half made, Simbody's parts cannot be taken apart: they stay */
            skeleton_free(made);
        }
        return status;
    }
    *out = made;
    return MHE_OK;
}

void skeleton_free(skeleton *s) {
    (void)guarded(nullptr, [&] { delete s; });
}

mhe_status skeleton_place(skeleton *s, const double *angle, double *r, double *p, mhe_error *err) {
    return guarded(err, [&] { place(*s, angle, r, p); });
}

mhe_status skeleton_dynamics(skeleton *s, const double *speed, const double *acceleration,
                             double *torque, double *mass, mhe_error *err) {
    return guarded(err, [&] {
        if (torque != nullptr) {
            inverse(*s, speed, acceleration, torque);
        }
        if (mass != nullptr) {
            mass_matrix(*s, mass);
        }
    });
}

mhe_status skeleton_loops(skeleton *s, const double *speed, const double *acceleration, double *gap,
                          double *rate, double *loop_acceleration, mhe_error *err) {
    return guarded(err, [&] { loops(*s, speed, acceleration, gap, rate, loop_acceleration); });
}
