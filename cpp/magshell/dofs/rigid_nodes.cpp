#include "magshell/dofs/rigid_nodes.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <utility>

namespace magshell {
namespace {

// Returns the rotation R that minimizes sum |x_i - R y_i|^2 (Kabsch). products: sum x_i y_i^T, with both point sets relative to their
// centers.
Mat3 nearest_rotation(const Mat3& products) {
    const Eigen::JacobiSVD<Mat3> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
    return svd.matrixU() * Vec3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

// Computes the orthogonal factor of the polar decomposition by Newton's iteration. Three iterations reach round-off from a matrix that is
// nearly a rotation.
Mat3 orthonormal(Mat3 m) {
    for (int round = 0; round < 3; ++round) m = (0.5 * (m + m.inverse().transpose())).eval();
    return m;
}

RigidNodes::RigidNodes(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest)
    : nodes_(std::move(nodes)), own_(own), middle_(Vec3::Zero()) {
    for (Index k = 0; k < corners; ++k) middle_ += rest[nodes_[k]] / double(corners);
    for (const Index node : nodes_) offsets_.push_back(rest[node] - middle_);
    length_ = offsets_.front().norm() / std::sqrt(3.0);
}

Vec3 RigidNodes::center(const VectorXd& q) const {
    Vec3 sum = Vec3::Zero();
    for (Index k = 0; k < corners; ++k) sum += q.segment<3>(3 * nodes_[k]);
    return sum / double(corners);
}

RigidNodes::Pose RigidNodes::pose(const VectorXd& q) const {
    const Vec3 c = center(q);
    Mat3 turn = Mat3::Zero();
    for (Index k = 0; k < corners; ++k) turn += (q.segment<3>(3 * nodes_[k]) - c) * offsets_[k].transpose();
    return {c, orthonormal(turn / (corners * length_ * length_))};
}

RigidNodes::Pose RigidNodes::pose_of_vertices(const VectorXd& q) const {
    const double count = size() - own_;
    Vec3 now = Vec3::Zero(), rest = Vec3::Zero();
    for (Index k = own_; k < size(); ++k) {
        now += q.segment<3>(3 * nodes_[k]) / count;
        rest += offsets_[k] / count;
    }
    Mat3 products = Mat3::Zero();
    for (Index k = own_; k < size(); ++k)
        products += (q.segment<3>(3 * nodes_[k]) - now) * (offsets_[k] - rest).transpose();
    const Mat3 turn = nearest_rotation(products);
    return {now - turn * rest, turn};
}

void RigidNodes::set_positions(const Pose& pose, VectorXd& q) const {
    for (Index k = 0; k < size(); ++k)
        q.segment<3>(3 * nodes_[k]) = pose.center + pose.rotation * offsets_[k];
}

}  // namespace magshell
