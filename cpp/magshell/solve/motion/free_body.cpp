#include "magshell/solve/motion/free_body.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace magshell {
namespace {

// [-] Smallest principal inertia, over the largest, of a body that can turn about every axis; see
// test_body_as_thin_as_a_line_has_no_flight.
constexpr double least_inertia = 1e-12;

Vec3 row(const VectorXd& rows, Index node) {
    return rows.segment<3>(3 * node);
}

// Adds the gradient with respect to the mass of a node, a third to each of its three dofs, which have the same mass.
void add_to_mass(double gradient, Index node, VectorXd& by_masses) {
    by_masses.segment<3>(3 * node).array() += gradient / 3.0;
}

}  // namespace

FreeBody::FreeBody(const RigidNodes& nodes, const VectorXd& masses) : nodes_(&nodes), arms_(nodes.offsets()) {
    Vec3 center = Vec3::Zero();
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const double m = masses_.emplace_back(masses[3 * nodes.nodes()[k]]);
        mass_ += m;
        center += m * arms_[k];
    }
    if (!(mass_ > 0.0)) return;
    center /= mass_;
    Mat3 inertia = Mat3::Zero();
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const Vec3& arm = arms_[k] -= center;
        inertia += masses_[k] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
    has_inertia_ = principal[0] > least_inertia * principal[2];
    if (has_inertia_) inverse_inertia_ = inertia.inverse();
}

RigidMotion FreeBody::motion(const VectorXd& q, const VectorXd& v) const {
    RigidMotion motion;
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        motion.center += masses_[k] / mass_ * row(q, nodes()[k]);
        motion.velocity += masses_[k] / mass_ * row(v, nodes()[k]);
    }
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const Index node = nodes()[k];
        motion.momentum += masses_[k] * (row(q, node) - motion.center).cross(row(v, node) - motion.velocity);
    }
    motion.turn = nodes_->pose(q).rotation;
    motion.momentum = (motion.turn.transpose() * motion.momentum).eval();
    return motion;
}

void FreeBody::motion_vjp(const RigidMotion& motion, const VectorXd& q, const VectorXd& v,
                          const RigidMotion& by, VectorXd& by_q, VectorXd& by_v, VectorXd& by_masses) const {
    const Vec3 by_momentum = motion.turn * by.momentum;  // in the axes of space
    const Mat3 by_turn = by.turn + motion.turn * motion.momentum * by.momentum.transpose();
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const Index node = nodes()[k];
        const double m = masses_[k], share = m / mass_;
        const Vec3 arm = row(q, node) - motion.center, along = row(v, node) - motion.velocity;
        // The momentum does not depend on the center and its velocity: the sums of m arm and of m along are zero.
        by_q.segment<3>(3 * node) += m * along.cross(by_momentum) + share * by.center;
        by_v.segment<3>(3 * node) += m * by_momentum.cross(arm) + share * by.velocity;
        add_to_mass(by_momentum.dot(arm.cross(along)) + (by.center.dot(arm) + by.velocity.dot(along)) / mass_,
                    node, by_masses);
    }
    for (Index k = 0; k < RigidNodes::corners; ++k)
        by_q.segment<3>(3 * nodes()[k]) += by_turn * nodes_->corner_weight(k);
}

void FreeBody::inertia_vjp(const Mat3& by_inverse_inertia, const Vec3& by_arms, VectorXd& by_masses) const {
    const Mat3 by_inertia = this->by_inertia(by_inverse_inertia);
    // A mass also moves the center, and so all arms by -arm / mass_; the inertia does not change by that.
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const Vec3& arm = arms_[k];
        add_to_mass(
            by_inertia.trace() * arm.squaredNorm() - arm.dot(by_inertia * arm) - by_arms.dot(arm) / mass_,
            nodes()[k], by_masses);
    }
}

// A vertex that moves at rest takes its own arm with it, and moves the center of mass, so that all arms change by - m / mass_ of that. The
// inertia does not depend on the center.
void FreeBody::rest_vjp(const Mat3& by_inverse_inertia, const ArmsGradient& by_arms,
                        VectorXd& by_nodes) const {
    const Mat3 by_inertia = this->by_inertia(by_inverse_inertia);
    for (std::size_t k = static_cast<std::size_t>(nodes_->own()); k < arms_.size(); ++k) {
        const Vec3& arm = arms_[k];
        const Vec3 through_inertia =
            2.0 * by_inertia.trace() * arm - (by_inertia + by_inertia.transpose()) * arm;
        by_nodes.segment<3>(3 * nodes()[k]) +=
            masses_[k] * (through_inertia - by_arms.together / mass_) + by_arms.each[k];
    }
}

Mat3 FreeBody::add_vjp(const Mat3& matrix, const VectorXd& by_rows, ArmsGradient& by_arms) const {
    Mat3 product = Mat3::Zero();
    Vec3 sum = Vec3::Zero();
    by_arms.each.resize(arms_.size(), Vec3::Zero());
    for (std::size_t k = 0; k < arms_.size(); ++k) {
        const Vec3 by = row(by_rows, nodes()[k]);
        product += by * arms_[k].transpose();
        sum += by;
        by_arms.each[k] += matrix.transpose() * by;
    }
    by_arms.together += matrix.transpose() * sum;
    return product;
}

std::vector<FreeBody> free_bodies(const DofMap& dof_map, const VectorXd& masses) {
    std::vector<FreeBody> found;
    for (const RigidNodes* nodes : dof_map.free_bodies())
        if (FreeBody body(*nodes, masses); body.has_inertia()) found.push_back(std::move(body));
    return found;
}

}  // namespace magshell
