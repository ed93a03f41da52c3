#include "magshell/assembly/skeleton_carrier.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

using Eigen::MatrixXd;

constexpr int most_fits = 30;
constexpr double fitted = 1e-14;  // of a length

Vec3 across(const Vec3& axis) {
    Index smallest;
    axis.cwiseAbs().minCoeff(&smallest);
    return axis.cross(Vec3::Unit(smallest)).normalized();
}

// The angle of the turn about an axis that a rotation is, or is closest to.
double angle_about(const Vec3& axis, const Mat3& turn) {
    const Vec3 u = across(axis), v = axis.cross(u);
    return std::atan2(v.dot(turn * u) - u.dot(turn * v), u.dot(turn * u) + v.dot(turn * v));
}

std::vector<Index> nodes_of(const std::vector<RigidNodes>& links) {
    std::vector<Index> all;
    for (const RigidNodes& link : links) all.insert(all.end(), link.nodes().begin(), link.nodes().end());
    return all;
}

// Of least norm where the rows leave coordinates undetermined.
auto solver_of(const MatrixXd& rows) {
    return rows.completeOrthogonalDecomposition();
}

}  // namespace

SkeletonCarrier::SkeletonCarrier(std::vector<RigidNodes> links, std::vector<Joint> joints,
                                 std::vector<Slots> slots)
    : Carrier(nodes_of(links)), links_(std::move(links)), joints_(std::move(joints)) {
    slots.resize(links_.size());
    slots_ = std::move(slots);
    Index row = 0;
    bool vertices = false;
    for (Index k = 0; k < n_links(); ++k) {
        first_.push_back(coordinates_);
        coordinates_ += joints_[k].freedom();
        row_.push_back(row);
        row += links_[k].size();
        vertices |= links_[k].has_vertices();
        if (!joints_[k].driven) continue;
        driven_.push_back({k, slots_[k].motor, n_driven_});
        n_driven_ += joints_[k].freedom();
    }
    Index free = 0, held = coordinates();
    for (const Joint& joint : joints_)
        for (Index j = 0; j < joint.freedom(); ++j) place_.push_back(joint.driven ? held++ : free++);
    auto paths = std::make_shared<LinkPaths>();
    for (Index k = 0; k < n_links(); ++k) {
        const auto own = place_.begin() + first_[k];
        paths->add_link(joints_[k].parent, {own, own + joints_[k].freedom()}, links_[k].size());
    }
    paths_ = std::move(paths);
    for (Index k = 0; k < n_links(); ++k)
        for (Index n = vertices ? links_[k].own() : 0; n < (vertices ? links_[k].size() : RigidNodes::points);
             ++n)
            leading_.push_back(row_[k] + n);
}

std::vector<SkeletonCarrier::Pose> SkeletonCarrier::poses(const VectorXd& q) const {
    std::vector<Pose> all;
    for (const RigidNodes& link : links_) all.push_back(link.pose(q));
    return all;
}

Mat3 SkeletonCarrier::frame(Index link, const std::vector<Pose>& poses) const {
    const Index parent = joints_[link].parent;
    return parent < 0 ? Mat3::Identity() : poses[parent].rotation;
}

Vec3 SkeletonCarrier::joint_place(Index link, const std::vector<Pose>& poses) const {
    const Joint& joint = joints_[link];
    if (joint.parent < 0) return joint.origin;
    const Pose& parent = poses[joint.parent];
    return parent.center + parent.rotation * (joint.origin - links_[joint.parent].middle());
}

std::vector<SkeletonCarrier::Column> SkeletonCarrier::columns(const std::vector<Pose>& poses) const {
    std::vector<Column> all;
    for (Index k = 0; k < n_links(); ++k) {
        const Joint& joint = joints_[k];
        const double radians = 1.0 / links_[k].length();
        const Mat3 frame = this->frame(k, poses);
        const Vec3 place = joint.kind == JointKind::free ? poses[k].center : joint_place(k, poses);
        if (joint.kind == JointKind::free)
            for (int c = 0; c < 3; ++c) all.push_back({false, Vec3::Unit(c), place, 1.0});
        if (joint.kind == JointKind::free || joint.kind == JointKind::ball)
            for (int c = 0; c < 3; ++c) all.push_back({true, Vec3::Unit(c), place, radians});
        if (joint.has_axis()) {
            const bool turns = joint.kind == JointKind::revolute;
            all.push_back({turns, frame * joint.axis, place, turns ? radians : 1.0});
        }
    }
    return all;
}

LinkTwists SkeletonCarrier::twists(const VectorXd& q) const {
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<Column> columns = this->columns(poses);
    std::vector<Vec3> points, arms;
    points.reserve(n_links());
    arms.reserve(nodes().size());
    LinkTwists::Twists twists(6, paths_->coordinate.size());
    std::vector<const Column*> by_place(coordinates_);
    for (Index j = 0; j < coordinates_; ++j) by_place[place_[j]] = &columns[j];
    for (Index k = 0; k < n_links(); ++k) {
        points.push_back(poses[k].center);
        for (const Index node : links_[k].nodes()) arms.push_back(q.segment<3>(3 * node) - points[k]);
        for (Index at = paths_->start[k]; at < paths_->start[k + 1]; ++at) {
            const Column& column = *by_place[paths_->coordinate[at]];
            const Vec3 axis = column.share * column.axis;
            const Vec3 velocity = column.turns ? axis.cross(points[k] - column.origin) : axis;
            twists.col(at).head<3>() = velocity;
            twists.col(at).tail<3>() = column.turns ? axis : Vec3(Vec3::Zero());
        }
    }
    return {paths_, std::move(points), std::move(arms), std::move(twists)};
}

// With F = sum g and M = sum (x - o_b) g^T over all that b moves, for turns about w_a and w_b
//   sum g . (w_a x (w_b x (x - o_b))) = w_a . M w_b - (w_a . w_b) tr M,   for a turn and a slide  (w_a x w_b) . F.
// An entry of two turns of one joint is that of the column's turn about a after the node's about b.
MatrixXd SkeletonCarrier::second_derivative(const VectorXd& q, const VectorXd& gradient) const {
    const std::vector<Column> columns = this->columns(poses(q));
    std::vector<Vec3> forces(n_links(), Vec3::Zero());
    std::vector<Mat3> products(n_links(),
                               Mat3::Zero());  // sum (x - place) g^T, each about a place of its own
    std::vector<Vec3> place(n_links());
    MatrixXd out = MatrixXd::Zero(coordinates_, coordinates_);
    for (Index k = 0; k < n_links(); ++k)
        place[k] = joints_[k].freedom() > 0 ? columns[first_[k]].origin : links_[k].center(q);
    for (Index k = n_links() - 1; k >= 0; --k) {
        const Joint& joint = joints_[k];
        for (const Index node : links_[k].nodes()) {
            const Vec3 g = gradient.segment<3>(3 * node);
            forces[k] += g;
            products[k] += (q.segment<3>(3 * node) - place[k]) * g.transpose();
        }
        // No later link adds to it.
        if (const Index parent = joint.parent; parent >= 0) {
            forces[parent] += forces[k];
            products[parent] += products[k] + (place[k] - place[parent]) * forces[k].transpose();
        }
        for (Index b = first_[k]; b < first_[k] + joint.freedom(); ++b) {
            const Column& inner = columns[b];
            const auto turn_and = [&](const Column& outer) {
                if (!inner.turns) return outer.axis.cross(inner.axis).dot(forces[k]);
                return outer.axis.dot(products[k] * inner.axis) -
                       outer.axis.dot(inner.axis) * products[k].trace();
            };
            for (Index above = k; above >= 0; above = joints_[above].parent)
                for (Index a = first_[above]; a < first_[above] + joints_[above].freedom(); ++a) {
                    const Column& outer = columns[a];
                    if (!outer.turns || (above == k && !inner.turns)) continue;
                    const Index i = place_[a], j = place_[b];
                    out(i, j) = outer.share * inner.share * turn_and(outer);
                    if (above != k) out(j, i) = out(i, j);
                }
        }
    }
    return out;
}

MatrixXd SkeletonCarrier::curvature(const VectorXd& q, const VectorXd& gradient) const {
    const MatrixXd second = second_derivative(q, gradient);
    return 0.5 * (second + second.transpose());
}

double SkeletonCarrier::coordinate(Index link, const std::vector<Pose>& poses) const {
    const Joint& joint = joints_[link];
    const Mat3 frame = this->frame(link, poses);
    if (joint.kind == JointKind::revolute)
        return angle_about(joint.axis, frame.transpose() * poses[link].rotation);
    const Vec3 own = poses[link].center - poses[link].rotation * (links_[link].middle() - joint.origin);
    return joint.axis.dot(frame.transpose() * (own - joint_place(link, poses)));
}

void SkeletonCarrier::set_values(const Values& values) {
    for (Motor& motor : driven_)
        for (Index c = 0; c < motor.slot.size(); ++c) motor.target[c] = values[motor.slot][c];
    for (Index k = 0; k < n_links(); ++k) {
        if (slots_[k].origin.size() > 0) joints_[k].origin = values.vector(slots_[k].origin);
        if (slots_[k].axis.size() > 0) joints_[k].axis = values.vector(slots_[k].axis);
    }
}

SkeletonCarrier::Pose SkeletonCarrier::moved(Index link, const std::vector<Pose>& from,
                                             const std::vector<Pose>& to, const double* z) const {
    const Joint& joint = joints_[link];
    const RigidNodes& nodes = links_[link];
    const auto turn = [&](const double* by) -> Mat3 {
        return rotation(Vec3(by[0], by[1], by[2]) / nodes.length());
    };
    if (joint.kind == JointKind::free)
        return {from[link].center + Vec3(z[0], z[1], z[2]), turn(z + 3) * from[link].rotation};
    const bool root = joint.parent < 0;
    const Mat3 before = root ? Mat3::Identity() : from[joint.parent].rotation,
               after = root ? Mat3::Identity() : to[joint.parent].rotation;
    Pose pose{joint_place(link, to), after};
    switch (joint.kind) {
        case JointKind::revolute:
            pose.rotation = after * rotation((coordinate(link, from) + z[0] / nodes.length()) * joint.axis);
            break;
        case JointKind::ball:
            pose.rotation = after * orthonormal(before.transpose() * turn(z) * from[link].rotation);
            break;
        case JointKind::prismatic:
            pose.center += (coordinate(link, from) + z[0]) * (after * joint.axis);
            break;
        default:
            break;
    }
    pose.center += pose.rotation * (nodes.middle() - joint.origin);
    return pose;
}

void SkeletonCarrier::move_on(VectorXd& q, std::vector<Pose> from, const VectorXd& z) const {
    std::vector<Pose> to(n_links());
    VectorXd by_joint(coordinates_);
    for (Index j = 0; j < coordinates_; ++j) by_joint[j] = z[place_[j]];
    for (Index k = 0; k < n_links(); ++k) {
        to[k] = moved(k, from, to, by_joint.data() + first_[k]);
        links_[k].place(to[k], q);
    }
}

void SkeletonCarrier::advance(VectorXd& q, const VectorXd& z) const {
    move_on(q, poses(q), z);
}

// A link's pose is known from corners l apart whose places are rounded as far from the origin as they are: to some
// epsilon |x|/l, of which four corners leave an eighth. The turn of its joint hands that on to all links after it, each at
// the end of its arm; what several joints do adds up by chance.
VectorXd SkeletonCarrier::rounding(const VectorXd& q) const {
    const std::vector<Pose> poses = this->poses(q);
    struct Sums {  // of w^2, w^2 o and w^2 |o|^2 over the joints on the way, w the rounding of a turn about o
        double one = 0.0, square = 0.0;
        Vec3 place = Vec3::Zero();
    };
    std::vector<Sums> all(n_links());
    VectorXd moved(nodes().size());
    for (Index k = 0; k < n_links(); ++k) {
        const Joint& joint = joints_[k];
        Sums& sums = all[k];
        if (joint.parent >= 0) sums = all[joint.parent];
        if (joint.kind == JointKind::revolute || joint.kind == JointKind::ball ||
            joint.kind == JointKind::free) {
            const double turn = 0.125 * poses[k].center.cwiseAbs().maxCoeff() / links_[k].length() + 1.0;
            const Vec3 at = joint.kind == JointKind::free ? poses[k].center : joint_place(k, poses);
            sums.one += turn * turn;
            sums.place += turn * turn * at;
            sums.square += turn * turn * at.squaredNorm();
        }
        for (Index n = 0; n < links_[k].size(); ++n) {
            const Vec3 x = q.segment<3>(3 * links_[k].nodes()[n]);
            moved[row_[k] + n] =
                std::sqrt(std::max(0.0, sums.square - 2.0 * x.dot(sums.place) + x.squaredNorm() * sums.one));
        }
    }
    return moved;
}

std::vector<SkeletonCarrier::Pose> SkeletonCarrier::first_fit(const VectorXd& q) const {
    std::vector<Pose> fit;
    for (const RigidNodes& link : links_)
        fit.push_back(link.has_vertices() ? link.pose_of_vertices(q) : link.pose(q));
    return fit;
}

MatrixXd SkeletonCarrier::leading(const MatrixXd& rows) const {
    MatrixXd picked(3 * leading_.size(), rows.cols());
    for (std::size_t k = 0; k < leading_.size(); ++k)
        picked.middleRows<3>(3 * k) = rows.middleRows<3>(3 * leading_[k]);
    return picked;
}

void SkeletonCarrier::scatter_leading(const VectorXd& leading, VectorXd& rows) const {
    for (std::size_t k = 0; k < leading_.size(); ++k)
        rows.segment<3>(3 * leading_[k]) = leading.segment<3>(3 * k);
}

void SkeletonCarrier::settle(VectorXd& q, VectorXd* v) const {
    const VectorXd given = leading(gather(q));
    move_on(q, first_fit(q), VectorXd::Zero(coordinates_));
    double before = std::numeric_limits<double>::infinity();
    for (int round = 0; round < most_fits && n_links() > 1; ++round) {
        const VectorXd off = given - leading(gather(q));
        if (!(off.norm() < before)) break;
        before = off.norm();
        const VectorXd z = solver_of(leading(jacobian(q))).solve(off);
        if (!(z.norm() > fitted * links_.front().length())) break;
        advance(q, z);
    }
    if (!v) return;
    const MatrixXd b = jacobian(q);
    scatter(b * solver_of(leading(b)).solve(leading(gather(*v))), *v);
}

// v = B z with z = B_l^+ v_l; as the pose moves by dz, B changes, whose products with z are d2x.
void SkeletonCarrier::settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                                 Gradient& out) const {
    const MatrixXd b = jacobian(q), led = leading(b);
    const auto inverse = solver_of(MatrixXd(led.transpose() * led));
    VectorXd by_pose = b.transpose() * gather(by_q);
    const VectorXd nothing = VectorXd::Zero(3 * nodes().size());
    VectorXd rates = VectorXd::Zero(coordinates_), apart = VectorXd::Zero(q.size()), by_state = apart;
    if (by_v.size() > 0) {
        const VectorXd by_rates = gather(by_v);
        const VectorXd by_leading = led * inverse.solve(b.transpose() * by_rates);
        VectorXd given = nothing;
        scatter_leading(by_leading, given);
        rates = inverse.solve(led.transpose() * leading(gather(v)));
        scatter(given, by_v);
        scatter(by_rates - given, apart);
        by_pose += second_derivative(q, apart).transpose() * rates;
    }
    if (leading_.size() < nodes().size()) {  // else its pose is the caller's own
        VectorXd given = nothing;
        scatter_leading(led * inverse.solve(by_pose), given);
        scatter(gather(by_q) - given, by_state);
        scatter(given, by_q);
    }
    places_vjp(q, by_state, rates, apart, out);
}

}  // namespace magshell
