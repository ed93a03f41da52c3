#include "magshell/terms/load/water_term.h"

namespace magshell {
namespace {

MovingFace::Corners corners_of(const std::array<Index, 3>& nodes, const VectorXd& all) {
    return {all.segment<3>(3 * nodes[0]), all.segment<3>(3 * nodes[1]), all.segment<3>(3 * nodes[2])};
}

Vec3 sum_of(const MovingFace::Corners& corners) {
    return corners[0] + corners[1] + corners[2];
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
      normal_viscous_drag_(registry.values.add("water", "normal_viscous_drag", "N s/m3", 1, 1)),
      tangential_viscous_drag_(registry.values.add("water", "tangential_viscous_drag", "N s/m3", 1, 1)),
      water_(water) {}

void WaterTerm::set_values(const Values& values) {
    water_.fluid_density = values.number(fluid_density_);
    water_.velocity = values.vector(velocity_);
    water_.drag_coefficient = values.number(drag_coefficient_);
    water_.thrust_coefficient = values.number(thrust_coefficient_);
    water_.added_mass = values.number(added_mass_);
    water_.normal_viscous_drag = values.number(normal_viscous_drag_);
    water_.tangential_viscous_drag = values.number(tangential_viscous_drag_);
}

MovingFace WaterTerm::moving_face(const VectorXd& q, const VectorXd& v, Index face) const {
    const std::array<Index, 3>& nodes = surface_.corners[face];
    return {water_.velocity, corners_of(nodes, q), corners_of(nodes, v)};
}

void WaterTerm::evaluate(const Kinematics& at, const LoadParameters&, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdVec3 g[3];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const MovingFace face = moving_face(at.q, at.v, loop_.face(group, lane));
            const Vec3 shared = Drag(water_, face).corner_force();
            const MovingFace::Corners inertial = AddedMass(water_.added_mass, face).by_position();
            for (int k = 0; k < 3; ++k) set_lane(g[k], lane, Vec3(-shared - inertial[k]));
        }
        loop_.scatter(group, g, out);
    });
}

// The symmetric part of the derivative with respect to the motion of a face as a whole, which all corners share, goes into
// the system matrix, which stays positive definite; the rest goes into the nonsymmetric tangent.
void WaterTerm::assemble(const Kinematics& at, const LoadParameters&, bool, SystemMatrix& out,
                         NonsymmetricTangent& rest) const {
    const bool inertial = has_added_mass();
    NonsymmetricTangent::FaceBlock* const shared = rest.append_face_blocks(surface_.n_faces());
    std::vector<NonsymmetricTangent::PairBlock> pairs(inertial ? surface_.n_faces() : 0);
    loop_.scatter_groups([&](Index group) {
        SimdMat3 h[6];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const MovingFace face = moving_face(at.q, at.v, f);
            const AddedMass added(water_.added_mass, face);
            const Drag::Jacobian jacobian = Drag(water_, face).corner_jacobian();
            const Mat3 by_motion =
                (at.rate / 3.0) * (at.rate * added.momentum_by_velocity() - jacobian.by_velocity);
            const Mat3 symmetric = 0.5 * (by_motion + by_motion.transpose());
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) h[0].at[3 * r + c].set(lane, symmetric(r, c));
            NonsymmetricTangent::FaceBlock& left = shared[f];
            left.nodes = surface_.corners[f];
            left.weights.setOnes();
            for (int k = 0; k < 3; ++k) {
                left.block.middleCols<3>(3 * k) = by_motion - symmetric - jacobian.by_position[k];
                if (inertial) left.block.middleCols<3>(3 * k) += at.rate * added.momentum_by_position(k);
            }
            if (!inertial) continue;
            // - d/dq of dT/dx, whose derivative by velocities is that of the momenta by positions, transposed.
            NonsymmetricTangent::PairBlock& turning = pairs[f];
            turning.nodes = {left.nodes[0], left.nodes[1], left.nodes[2], -1};
            const AddedMass::Mat9 hessian = added.hessian();
            for (int k = 0; k < 3; ++k) {
                const Mat3 by_velocity = at.rate * added.momentum_by_position(k).transpose();
                for (int l = 0; l < 3; ++l)
                    turning.blocks[4 * k + l] = -hessian.block<3, 3>(3 * k, 3 * l) - by_velocity;
            }
        }
        for (int k = 1; k < 6; ++k) h[k] = h[0];
        loop_.scatter(group, h, out);
    });
    for (const NonsymmetricTangent::PairBlock& each : pairs) rest.append_pair() = each;
}

void WaterTerm::vjp(const Kinematics& at, const LoadParameters&, const VectorXd& lambda,
                    KinematicsGradient& by, Gradient& out) const {
    Drag::Gradient sum;
    double by_added_mass = 0.0;
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const MovingFace face = moving_face(at.q, at.v, f);
        const Drag drag(water_, face);
        const MovingFace::Corners along = corners_of(surface_.corners[f], lambda);
        const Vec3 mean = sum_of(along) / 3.0;
        const AddedMass::Gradient inertial = AddedMass(water_.added_mass, face).of_force(along);
        const Vec3 by_velocity =
            drag.corner_jacobian().by_velocity.transpose() * mean + inertial.velocity / 3.0;
        for (const Index node : surface_.corners[f]) by.velocity.segment<3>(3 * node) += by_velocity;
        sum.add(drag.gradient(mean), -1.0);
        sum.velocity += inertial.velocity;
        by_added_mass -= inertial.added_mass;
    }
    out.values[fluid_density_.first] += sum.fluid_density;
    out.values.segment<3>(velocity_.first) += sum.velocity;
    out.values[drag_coefficient_.first] += sum.drag_coefficient;
    out.values[thrust_coefficient_.first] += sum.thrust_coefficient;
    out.values[added_mass_.first] += by_added_mass;
    out.values[normal_viscous_drag_.first] += sum.normal_viscous_drag;
    out.values[tangential_viscous_drag_.first] += sum.tangential_viscous_drag;
}

void WaterTerm::add_momentum(const VectorXd& q, const VectorXd& v, VectorXd& out) const {
    if (!has_added_mass()) return;
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const MovingFace face = moving_face(q, v, f);
        const Vec3 momentum = AddedMass(water_.added_mass, face).corner_momentum();
        for (const Index node : surface_.corners[f]) out.segment<3>(3 * node) += momentum;
    }
}

void WaterTerm::momentum_vjp(const VectorXd& q, const VectorXd& v, const VectorXd& lambda, VectorXd& by_q,
                             VectorXd& by_v, Gradient& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const std::array<Index, 3>& nodes = surface_.corners[f];
        const MovingFace face = moving_face(q, v, f);
        const AddedMass added(water_.added_mass, face);
        const Vec3 sum = sum_of(corners_of(nodes, lambda));
        const AddedMass::Gradient by = added.of_momentum(sum);
        for (int k = 0; k < 3; ++k) {
            by_q.segment<3>(3 * nodes[k]) += added.momentum_by_position(k).transpose() * sum;
            by_v.segment<3>(3 * nodes[k]) += by.velocity / 3.0;
        }
        out.values.segment<3>(velocity_.first) -= by.velocity;
        out.values[added_mass_.first] += by.added_mass;
    }
}

double WaterTerm::fluid_energy(const VectorXd& q, const VectorXd& v, VectorXd* by_q) const {
    double sum = 0.0;
    if (!has_added_mass()) return sum;
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const MovingFace face = moving_face(q, v, f);
        const AddedMass added(water_.added_mass, face);
        sum += added.energy(water_.velocity);
        if (!by_q) continue;
        const MovingFace::Corners forces = added.by_position();
        for (int k = 0; k < 3; ++k) by_q->segment<3>(3 * surface_.corners[f][k]) += forces[k];
    }
    return sum;
}

// A momentum over the time of a stage has the round-off of positions, as the inertial force of the masses has, and that of itself.
void WaterTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    if (!has_added_mass()) return;
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const MovingFace face = moving_face(at.q, at.v, f);
        const MovingFace::Corners x = corners_of(surface_.corners[f], at.q);
        const double reach = sum_of({x[0].cwiseAbs(), x[1].cwiseAbs(), x[2].cwiseAbs()}).maxCoeff() / 3.0;
        const double force = water_.added_mass * face.area / 3.0 * at.rate *
                             (at.rate * reach + std::abs(face.normal.dot(face.flow)));
        for (const Index node : surface_.corners[f]) out.segment<3>(3 * node).array() += force;
    }
}

}  // namespace magshell
