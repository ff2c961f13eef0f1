/* SPDX-License-Identifier: Apache-2.0 */
/* skeleton.cpp: the one file that knows Simbody. */
/* Simbody's classes have other members under NDEBUG. Debian's libraries are built without it, so
 * this file is too, in every build type. */
#undef NDEBUG

#include "skeleton.h"

#include <Simbody.h>

#include <exception>
#include <new>
#include <vector>

using namespace SimTK;

struct skeleton {
    const tree *source;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    std::vector<MobilizedBody> links;
    std::vector<int> q, u; /* Simbody's numbers of the joints */
    State state;
    Vector none, acceleration, torque;
    Vector_<SpatialVec> weight; /* gravity on each body, filled at the pose */
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

MassProperties mass_properties(const tree_joint &link, bool with_mass) {
    if (!with_mass || link.mass <= 0) {
        return MassProperties(0, Vec3(0), Inertia(0));
    }
    const double *i = link.inertia;
    Inertia central(i[0], i[4], i[8], i[1], i[2], i[5]);
    Vec3 com = vector(link.com);
    return MassProperties(link.mass, com, central.shiftFromMassCenter(-com, link.mass));
}

void add_link(skeleton &s, const tree_joint &joint, bool with_mass) {
    MobilizedBody &parent =
        joint.parent < 0 ? s.matter.updGround() : s.links[static_cast<size_t>(joint.parent)];
    /* the file's matrix as it is: Simbody would project a rounded one, and points of the same body
     * would then be placed by another matrix */
    Transform at(Rotation(matrix(joint.r), true), vector(joint.p));
    Body::Rigid body(mass_properties(joint, with_mass));
    if (joint.kind == MHE_MOTION_ROTATION) {
        s.links.push_back(MobilizedBody::Pin(parent, at, body, Transform()));
    } else {
        s.links.push_back(MobilizedBody::Slider(parent, at, body, Transform()));
    }
}

void build(skeleton &s, bool with_mass) {
    for (int32_t i = 0; i < s.source->n_joints; i++) {
        add_link(s, s.source->joints[i], with_mass);
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
}

void mass_matrix(skeleton &s, double *mass) {
    s.matter.calcM(s.state, s.mass);
    size_t n = s.links.size();
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            mass[n * i + j] = s.mass(s.u[i], s.u[j]);
        }
    }
}

} // namespace

mhe_status skeleton_create(const tree *source, int32_t with_mass, skeleton **out, mhe_error *err) {
    *out = nullptr;
    skeleton *made = nullptr;
    mhe_status status = guarded(err, [&] {
        made = new skeleton(source);
        build(*made, with_mass != 0);
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
