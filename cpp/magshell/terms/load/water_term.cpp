#include "magshell/terms/load/water_term.h"

namespace magshell {
namespace {

Drag::Corners corners_of(const std::array<Index, 3>& nodes, const VectorXd& all) {
    return {all.segment<3>(3 * nodes[0]), all.segment<3>(3 * nodes[1]), all.segment<3>(3 * nodes[2])};
}

}  // namespace

WaterTerm::WaterTerm(const Surface& surface, const FaceLoop& faces, const Water& water, Registry& registry)
    : surface_(surface),
      loop_(faces),
      fluid_density_(registry.values.add("water", "fluid_density", "kg/m3", 1, 1)),
      velocity_(registry.values.add("water", "velocity", "m/s", 1, 3)),
      drag_coefficient_(registry.values.add("water", "drag_coefficient", "1", 1, 1)),
      thrust_coefficient_(registry.values.add("water", "thrust_coefficient", "1", 1, 1)),
      added_mass_(registry.values.add("water", "added_mass", "kg/m2", 1, 1)),
      water_(water) {}

void WaterTerm::set_values(const Values& values) {
    water_.fluid_density = values.number(fluid_density_);
    water_.velocity = values.vector(velocity_);
    water_.drag_coefficient = values.number(drag_coefficient_);
    water_.thrust_coefficient = values.number(thrust_coefficient_);
    water_.added_mass = values.number(added_mass_);
}

Drag WaterTerm::drag(const Kinematics& at, Index face) const {
    const std::array<Index, 3>& nodes = surface_.corners[face];
    return {water_, corners_of(nodes, at.q), corners_of(nodes, at.v), corners_of(nodes, at.w)};
}

void WaterTerm::evaluate(const Kinematics& at, const LoadParameters&, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdVec3 g[3];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            set_lane(g[0], lane, Vec3(-drag(at, loop_.face(group, lane)).corner_force()));
        g[1] = g[2] = g[0];
        loop_.scatter(group, g, out);
    });
}

// All corners of a face have the same force. The symmetric part of its derivative with respect to the motion of the face as
// a whole goes into the system matrix, which stays positive definite; the rest goes into the nonsymmetric
// tangent.
void WaterTerm::assemble(const Kinematics& at, const LoadParameters&, bool, SystemMatrix& out,
                         NonsymmetricTangent& rest) const {
    NonsymmetricTangent::FaceBlock* const shared = rest.append_face_blocks(surface_.n_faces());
    loop_.scatter_groups([&](Index group) {
        SimdMat3 h[6];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const Drag::Jacobian jacobian = drag(at, f).corner_jacobian();
            const Mat3 by_motion =
                (-at.rate / 3.0) * (jacobian.by_velocity + at.rate * jacobian.by_acceleration);
            const Mat3 symmetric = 0.5 * (by_motion + by_motion.transpose());
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) h[0].at[3 * r + c].set(lane, symmetric(r, c));
            NonsymmetricTangent::FaceBlock& left = shared[f];
            left.nodes = surface_.corners[f];
            left.weights.setOnes();
            for (int k = 0; k < 3; ++k)
                left.block.middleCols<3>(3 * k) = by_motion - symmetric - jacobian.by_position[k];
        }
        for (int k = 1; k < 6; ++k) h[k] = h[0];
        loop_.scatter(group, h, out);
    });
}

void WaterTerm::vjp(const Kinematics& at, const LoadParameters&, const VectorXd& lambda,
                    KinematicsGradient& by, Gradient& out) const {
    Drag::Gradient sum;
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const Drag face = drag(at, f);
        const Drag::Jacobian jacobian = face.corner_jacobian();
        const Drag::Corners along = corners_of(surface_.corners[f], lambda);
        const Vec3 mean = (along[0] + along[1] + along[2]) / 3.0;
        const Vec3 by_velocity = jacobian.by_velocity.transpose() * mean,
                   by_acceleration = jacobian.by_acceleration.transpose() * mean;
        for (const Index node : surface_.corners[f]) {
            by.velocity.segment<3>(3 * node) += by_velocity;
            by.acceleration.segment<3>(3 * node) += by_acceleration;
        }
        sum.add(face.gradient(mean), -1.0);
    }
    out.values[fluid_density_.first] += sum.fluid_density;
    out.values.segment<3>(velocity_.first) += sum.velocity;
    out.values[drag_coefficient_.first] += sum.drag_coefficient;
    out.values[thrust_coefficient_.first] += sum.thrust_coefficient;
    out.values[added_mass_.first] += sum.added_mass;
}

}  // namespace magshell
