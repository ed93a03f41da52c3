// What motors prescribe of a skeleton's joints: how far these are off, and how gradients go back to the motors' values.
#include <cmath>
#include <numbers>

#include "magshell/assembly/skeleton_carrier.h"
#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

constexpr double round_off = 1e-14;  // of a length

}  // namespace

// By the shorter way round.
VectorXd SkeletonCarrier::driven_increment(const VectorXd& q) const {
    if (driven_.empty()) return {};
    const std::vector<Pose> poses = this->poses(q);
    VectorXd increment = VectorXd::Zero(driven());
    for (const Motor& motor : driven_) {
        const Index link = motor.link, n = joints_[link].freedom();
        const double length = links_[link].length(),
                     reach = poses[link].center.cwiseAbs().maxCoeff() + length;
        Vec3 off = Vec3::Zero();
        double rounds = reach + length * motor.target.norm();
        if (joints_[link].kind == JointKind::ball) {
            const Eigen::AngleAxisd turn(
                orthonormal(frame(link, poses) * rotation(motor.target) * poses[link].rotation.transpose()));
            off = length * turn.angle() * turn.axis();
        } else {
            off[0] = motor.target[0] - coordinate(link, poses);
            if (joints_[link].kind == JointKind::revolute)
                off[0] = length * std::remainder(off[0], 2.0 * std::numbers::pi);
            else
                rounds = reach + std::abs(motor.target[0]);
        }
        if (off.norm() > round_off * rounds)
            for (Index k = 0; k < n; ++k) increment[motor.first + k] = off[k];
    }
    return increment;
}

VectorXd SkeletonCarrier::driven_units() const {
    VectorXd units(driven());
    for (const Motor& motor : driven_) {
        const Joint& joint = joints_[motor.link];
        units.segment(motor.first, joint.freedom())
            .setConstant(joint.kind == JointKind::prismatic ? 1.0 : links_[motor.link].length());
    }
    return units;
}

void SkeletonCarrier::driven_vjp(const VectorXd& q, const VectorXd& by_driven, Gradient& out) const {
    const VectorXd by_units = driven_units().cwiseProduct(by_driven);
    const std::vector<Pose> poses = this->poses(q);
    for (const Motor& motor : driven_) {
        if (joints_[motor.link].kind != JointKind::ball) {
            out.values[motor.slot.first] += by_units[motor.first];
            continue;
        }
        const Vec3 moment = frame(motor.link, poses).transpose() * by_units.segment<3>(motor.first);
        out.values.segment<3>(motor.slot.first) += transposed_jacobian_times(motor.target, moment);
    }
}

std::vector<Vec3> SkeletonCarrier::ball_couples(const VectorXd& q, const VectorXd& gradient,
                                                const VectorXd& z, const std::vector<Column>& columns) const {
    const VectorXd pull = twists(q).pull_back(gather(gradient));
    std::vector<Vec3> couples(n_links(), Vec3::Zero());
    for (Index k = 0; k < n_links(); ++k) {
        if (joints_[k].kind != JointKind::ball) continue;
        Vec3 rate, moment;
        for (int c = 0; c < 3; ++c) {
            const Index j = first_[k] + c, at = place_[j];
            rate[c] = columns[j].share * z[at];
            moment[c] = pull[at] / columns[j].share;
        }
        couples[k] = rate.cross(moment);
    }
    return couples;
}

VectorXd SkeletonCarrier::driving_change(const VectorXd& q, const VectorXd& gradient,
                                         const VectorXd& driven) const {
    VectorXd z = VectorXd::Zero(coordinates_);
    z.tail(n_driven_) = driven;
    VectorXd change = second_derivative(q, gradient).transpose() * z;
    const std::vector<Column> columns = this->columns(poses(q));
    const std::vector<Vec3> couples = ball_couples(q, gradient, z, columns);
    for (const Motor& motor : driven_) {
        if (joints_[motor.link].kind != JointKind::ball) continue;
        for (Index above = joints_[motor.link].parent; above >= 0; above = joints_[above].parent)
            for (Index a = first_[above]; a < first_[above] + joints_[above].freedom(); ++a)
                if (columns[a].turns)
                    change[place_[a]] -= columns[a].share * columns[a].axis.dot(couples[motor.link]);
    }
    return change;
}

}  // namespace magshell
