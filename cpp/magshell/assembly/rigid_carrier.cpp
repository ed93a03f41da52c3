#include "magshell/assembly/rigid_carrier.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

using Eigen::MatrixXd;

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
    return m;
}

// The rotation next to a matrix that is one but for rounding: Newton's iteration for the polar decomposition.
Mat3 orthonormal(Mat3 m) {
    for (int round = 0; round < 3; ++round) m = (0.5 * (m + m.inverse().transpose())).eval();
    return m;
}

// The rotation that turns one set of points into another best, from sum of their products.
Mat3 nearest_rotation(const Mat3& products) {
    const Eigen::JacobiSVD<Mat3> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
    return svd.matrixU() * Vec3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

RigidCarrier::RigidCarrier(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest)
    : Carrier(std::move(nodes)), own_(own) {
    const Index count = static_cast<Index>(this->nodes().size());
    leading_ = 3 * (count > own ? count - own : count);
    Vec3 middle = Vec3::Zero();
    for (Index k = 0; k < corners; ++k) middle += rest[this->nodes()[k]] / double(corners);
    for (const Index node : this->nodes()) offsets_.push_back(rest[node] - middle);
    length_ = offsets_.front().norm() / std::sqrt(3.0);
}

Vec3 RigidCarrier::center(const VectorXd& q) const {
    Vec3 sum = Vec3::Zero();
    for (Index k = 0; k < corners; ++k) sum += q.segment<3>(3 * nodes()[k]);
    return sum / double(corners);
}

RigidCarrier::Pose RigidCarrier::pose(const VectorXd& q) const {
    const Vec3 c = center(q);
    Mat3 turn = Mat3::Zero();
    for (Index k = 0; k < corners; ++k) turn += (q.segment<3>(3 * nodes()[k]) - c) * offsets_[k].transpose();
    return {c, orthonormal(turn / (corners * length_ * length_))};
}

RigidCarrier::Pose RigidCarrier::pose_of_vertices(const VectorXd& q) const {
    const Index count = static_cast<Index>(nodes().size());
    Vec3 now = Vec3::Zero(), rest = Vec3::Zero();
    for (Index k = own_; k < count; ++k) {
        now += q.segment<3>(3 * nodes()[k]) / double(count - own_);
        rest += offsets_[k] / double(count - own_);
    }
    Mat3 products = Mat3::Zero();
    for (Index k = own_; k < count; ++k)
        products += (q.segment<3>(3 * nodes()[k]) - now) * (offsets_[k] - rest).transpose();
    const Mat3 turn = nearest_rotation(products);
    return {now - turn * rest, turn};
}

void RigidCarrier::place(const Pose& pose, VectorXd& q) const {
    for (std::size_t k = 0; k < nodes().size(); ++k)
        q.segment<3>(3 * nodes()[k]) = pose.center + pose.rotation * offsets_[k];
}

MatrixXd RigidCarrier::jacobian(const VectorXd& q) const {
    const Vec3 c = center(q);
    MatrixXd b(3 * nodes().size(), 6);
    for (std::size_t k = 0; k < nodes().size(); ++k) {
        b.block<3, 3>(3 * k, 0).setIdentity();
        b.block<3, 3>(3 * k, 3) = cross_matrix(q.segment<3>(3 * nodes()[k]) - c) / -length_;
    }
    return b;
}

MatrixXd RigidCarrier::curvature(const VectorXd& q, const VectorXd& gradient) const {
    const Vec3 c = center(q);
    Mat3 products = Mat3::Zero();
    for (const Index node : nodes())
        products += (q.segment<3>(3 * node) - c) * gradient.segment<3>(3 * node).transpose();
    MatrixXd block = MatrixXd::Zero(6, 6);
    block.bottomRightCorner<3, 3>() =
        (0.5 * (products + products.transpose()) - products.trace() * Mat3::Identity()) / (length_ * length_);
    return block;
}

void RigidCarrier::advance(VectorXd& q, const VectorXd& z) const {
    Pose now = pose(q);
    now.center += z.head<3>();
    now.rotation = rotation(z.tail<3>() / length_) * now.rotation;
    place(now, q);
}

void RigidCarrier::settle(VectorXd& q, VectorXd* v) const {
    if (static_cast<Index>(nodes().size()) > own_) place(pose_of_vertices(q), q);
    if (!v) return;
    const MatrixXd b = jacobian(q), led = leading(b);
    const VectorXd z = (led.transpose() * led).ldlt().solve(led.transpose() * gather(*v).tail(leading_));
    scatter(b * z, *v);
}

// v = B z, z = (B_v^T B_v)^-1 B_v^T v_v; as the pose turns by d, B z changes by w x (d x r).
void RigidCarrier::settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v) const {
    const MatrixXd b = jacobian(q), led = leading(b);
    const Eigen::LDLT<MatrixXd> normal(led.transpose() * led);
    VectorXd by_pose = b.transpose() * gather(by_q);
    const VectorXd nothing = VectorXd::Zero(3 * nodes().size());
    if (by_v.size() > 0) {
        VectorXd by_rates = gather(by_v);
        const VectorXd by_given = led * normal.solve(b.transpose() * by_rates);
        VectorXd given = nothing;
        given.tail(leading_) = by_given;
        scatter(given, by_v);
        const VectorXd z = normal.solve(led.transpose() * gather(v).tail(leading_));
        const Vec3 turning = z.tail<3>() / length_, c = center(q);
        by_rates -= given;
        Vec3 torque = Vec3::Zero();
        for (std::size_t k = 0; k < nodes().size(); ++k)
            torque += (q.segment<3>(3 * nodes()[k]) - c).cross(by_rates.segment<3>(3 * k).cross(turning));
        by_pose.tail<3>() += torque / length_;
    }
    if (static_cast<Index>(nodes().size()) == own_) return;  // its pose is the caller's own
    VectorXd given = nothing;
    given.tail(leading_) = led * normal.solve(by_pose);
    scatter(given, by_q);
}

}  // namespace magshell
