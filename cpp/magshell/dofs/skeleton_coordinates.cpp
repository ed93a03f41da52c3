#include "magshell/dofs/skeleton_coordinates.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

using Eigen::MatrixXd;

// Largest number of Gauss-Newton iterations that fit the coordinates to a start; see test_joints_hold_to_round_off_over_ten_thousand_steps.
constexpr int max_fit_iterations = 30;
// [-] Change of the coordinates, over the length of the first link, at which the fit ends; see
// test_joints_hold_to_round_off_over_ten_thousand_steps.
constexpr double fit_tolerance = 1e-14;
// [-] Distance of a motor from its target, over the lengths from which it is computed, that counts as round-off; see
// test_motor_holds_an_arm_at_its_angle_and_reports_its_torque.
constexpr double motor_round_off = 1e-14;
// [-] Error of the rotation of a link that is computed from four corners, over epsilon |x|/l; see rounding() and
// test_long_chains_of_links_move_at_the_usual_tolerance.
constexpr double rotation_round_off = 0.125;

constexpr Index free_coordinates = 6;  // of a link that no joint holds

// Returns the nodes of all links, link by link.
std::vector<Index> nodes_of(const std::vector<RigidNodes>& links) {
    std::vector<Index> all;
    for (const RigidNodes& link : links) all.insert(all.end(), link.nodes().begin(), link.nodes().end());
    return all;
}

// Solves for the minimum-norm least-squares solution, because the rows may not determine all coordinates, of which there may be none: Eigen
// does not decompose matrices without columns.
class LeastSquares {
  public:
    explicit LeastSquares(const MatrixXd& rows) {
        if (rows.cols() > 0) factor_ = rows.completeOrthogonalDecomposition();
    }
    VectorXd solve(const VectorXd& wanted) const {
        return factor_ ? VectorXd(factor_->solve(wanted)) : VectorXd();
    }

  private:
    std::optional<Eigen::CompleteOrthogonalDecomposition<MatrixXd>> factor_;
};

}  // namespace

SkeletonCoordinates::SkeletonCoordinates(std::vector<RigidNodes> links, std::vector<Joint> joints,
                                         std::vector<ParameterSlices> slices)
    : ReducedCoordinates(nodes_of(links)), links_(std::move(links)), joints_(std::move(joints)) {
    slices.resize(links_.size());
    slices_ = std::move(slices);
    Index row = 0;
    bool vertices = false;
    for (Index k = 0; k < n_links(); ++k) {
        first_.push_back(coordinates_);
        coordinates_ += joints_[k].freedom();
        row_.push_back(row);
        row += links_[k].size();
        if (!joints_[k].traits().has_origin) joints_[k].origin = links_[k].middle();
        vertices |= links_[k].has_vertices();
        if (!joints_[k].has_motor) continue;
        motors_.push_back({k, slices_[k].motor, n_motor_coordinates_});
        n_motor_coordinates_ += joints_[k].freedom();
    }
    Index free = 0, held = coordinates();
    for (const Joint& joint : joints_)
        for (Index j = 0; j < joint.freedom(); ++j) column_of_.push_back(joint.has_motor ? held++ : free++);
    auto paths = std::make_shared<LinkPaths>();
    for (Index k = 0; k < n_links(); ++k) {
        const auto own = column_of_.begin() + first_[k];
        paths->add_link(joints_[k].parent, {own, own + joints_[k].freedom()}, links_[k].size());
    }
    paths_ = std::move(paths);
    for (Index k = 0; k < n_links(); ++k)
        for (Index n = vertices ? links_[k].own() : 0; n < (vertices ? links_[k].size() : RigidNodes::points);
             ++n)
            leading_.push_back(row_[k] + n);
}

std::vector<const RigidNodes*> SkeletonCoordinates::free_bodies() const {
    std::vector<const RigidNodes*> found;
    for (Index k = 0; k < n_links(); ++k) {
        const auto is_child = [&](const Joint& joint) { return joint.parent == k; };
        const bool is_root = joints_[k].parent < 0 && joints_[k].freedom() == free_coordinates;
        if (is_root && std::ranges::none_of(joints_, is_child)) found.push_back(&links_[k]);
    }
    return found;
}

std::vector<SkeletonCoordinates::Pose> SkeletonCoordinates::poses(const VectorXd& q) const {
    std::vector<Pose> all;
    for (const RigidNodes& link : links_) all.push_back(link.pose(q));
    return all;
}

Mat3 SkeletonCoordinates::frame(Index link, const std::vector<Pose>& poses) const {
    const Index parent = joints_[link].parent;
    return parent < 0 ? Mat3::Identity() : poses[parent].rotation;
}

JointSide SkeletonCoordinates::parent_side(Index link, const std::vector<Pose>& poses) const {
    const Joint& joint = joints_[link];
    if (joint.parent < 0) return {joint.origin, Mat3::Identity()};
    const Pose& parent = poses[joint.parent];
    return {parent.center + parent.rotation * (joint.origin - links_[joint.parent].middle()),
            parent.rotation};
}

JointSide SkeletonCoordinates::child_side(Index link, const std::vector<Pose>& poses) const {
    const Pose& pose = poses[link];
    return {pose.center - pose.rotation * (links_[link].middle() - joints_[link].origin), pose.rotation};
}

std::vector<JointColumn> SkeletonCoordinates::columns(const std::vector<Pose>& poses) const {
    std::vector<JointColumn> all;
    for (Index k = 0; k < n_links(); ++k)
        joints_[k].kind->add_columns(joints_[k], parent_side(k, poses), child_side(k, poses),
                                     1.0 / links_[k].length(), all);
    return all;
}

LinkTwists SkeletonCoordinates::twists(const VectorXd& q) const {
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<JointColumn> columns = this->columns(poses);
    std::vector<Vec3> points, arms;
    points.reserve(n_links());
    arms.reserve(nodes().size());
    LinkTwists::Twists twists(6, paths_->coordinate.size());
    std::vector<const JointColumn*> by_column(coordinates_);
    for (Index j = 0; j < coordinates_; ++j) by_column[column_of_[j]] = &columns[j];
    for (Index k = 0; k < n_links(); ++k) {
        points.push_back(poses[k].center);
        for (const Index node : links_[k].nodes()) arms.push_back(q.segment<3>(3 * node) - points[k]);
        for (Index at = paths_->start[k]; at < paths_->start[k + 1]; ++at) {
            const JointColumn& column = *by_column[paths_->coordinate[at]];
            const Vec3 axis = column.scale * column.axis;
            const Vec3 velocity =
                column.is_rotation ? axis.cross(points[k] - column.origin) + column.pitch * axis : axis;
            twists.col(at).head<3>() = velocity;
            twists.col(at).tail<3>() = column.is_rotation ? axis : Vec3(Vec3::Zero());
        }
    }
    return {paths_, std::move(points), std::move(arms), std::move(twists)};
}

// Let F = sum g and M = sum (x - o_b) g^T over all nodes that coordinate b moves. The entry (a, b), with a on the path from the root to b,
// is
//
//   a and b rotate:                  sum g . (w_a x (w_b x (x - o_b) + h_b w_b)) = w_a . M w_b - (w_a . w_b) tr M + h_b (w_a x w_b) . F
//   a rotates, b translates:         (w_a x w_b) . F
//   a translates:                    0
//
// each times the scales of a and b. For two rotations of one joint, in entry (a, b) the rotation b acts first.
MatrixXd SkeletonCoordinates::second_derivative(const VectorXd& q, const VectorXd& gradient) const {
    const std::vector<JointColumn> columns = this->columns(poses(q));
    std::vector<Vec3> forces(n_links(), Vec3::Zero());
    std::vector<Mat3> products(n_links(),
                               Mat3::Zero());  // sum (x - place) g^T
    std::vector<Vec3> place(n_links());        // one point per link: o of its joint, or its center
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
        // The sums of this link are complete: all links beyond it have later numbers and were added before.
        if (const Index parent = joint.parent; parent >= 0) {
            forces[parent] += forces[k];
            products[parent] += products[k] + (place[k] - place[parent]) * forces[k].transpose();
        }
        for (Index b = first_[k]; b < first_[k] + joint.freedom(); ++b) {
            const JointColumn& inner = columns[b];
            const auto turn_and = [&](const JointColumn& outer) {
                if (!inner.is_rotation) return outer.axis.cross(inner.axis).dot(forces[k]);
                const double turned = outer.axis.dot(products[k] * inner.axis) -
                                      outer.axis.dot(inner.axis) * products[k].trace();
                if (inner.pitch == 0.0) return turned;
                return turned + inner.pitch * outer.axis.cross(inner.axis).dot(forces[k]);
            };
            for (Index above = k; above >= 0; above = joints_[above].parent)
                for (Index a = first_[above]; a < first_[above] + joints_[above].freedom(); ++a) {
                    const JointColumn& outer = columns[a];
                    if (!outer.is_rotation || (above == k && !inner.is_rotation)) continue;
                    const Index i = column_of_[a], j = column_of_[b];
                    out(i, j) = outer.scale * inner.scale * turn_and(outer);
                    if (above != k) out(j, i) = out(i, j);
                }
        }
    }
    return out;
}

MatrixXd SkeletonCoordinates::curvature(const VectorXd& q, const VectorXd& gradient) const {
    const MatrixXd second = second_derivative(q, gradient);
    return 0.5 * (second + second.transpose());
}

void SkeletonCoordinates::set_values(const Values& values) {
    for (Motor& motor : motors_)
        for (Index c = 0; c < motor.slice.size(); ++c) motor.target[c] = values[motor.slice][c];
    for (Index k = 0; k < n_links(); ++k) {
        if (slices_[k].origin.size() > 0) joints_[k].origin = values.vector(slices_[k].origin);
        if (slices_[k].axis.size() > 0) joints_[k].axis = values.vector(slices_[k].axis);
        joints_[k].replace_numbers(values, slices_[k].numbers);
    }
}

SkeletonCoordinates::Pose SkeletonCoordinates::moved_pose(Index link, const std::vector<Pose>& from,
                                                          const std::vector<Pose>& to,
                                                          const double* z) const {
    const Joint& joint = joints_[link];
    const RigidNodes& nodes = links_[link];
    const JointSide side = joint.kind->moved(joint, parent_side(link, from), child_side(link, from),
                                             parent_side(link, to), z, nodes.length());
    return {side.origin + side.rotation * (nodes.middle() - joint.origin), side.rotation};
}

void SkeletonCoordinates::move_links(VectorXd& q, std::vector<Pose> from, const VectorXd& z) const {
    std::vector<Pose> to(n_links());
    VectorXd by_joint(coordinates_);
    for (Index j = 0; j < coordinates_; ++j) by_joint[j] = z[column_of_[j]];
    for (Index k = 0; k < n_links(); ++k) {
        to[k] = moved_pose(k, from, to, by_joint.data() + first_[k]);
        links_[k].set_positions(to[k], q);
    }
}

void SkeletonCoordinates::retract(VectorXd& q, const VectorXd& z) const {
    move_links(q, poses(q), z);
}

// The pose of a link is computed from corners with distances of about l, whose coordinates have round-off errors of epsilon |x|, |x| the
// distance from the origin. So its rotation has an error of about epsilon |x|/l, of which the mean of four corners leaves an eighth
// (rotation_round_off); computing the rotation adds epsilon. If a joint rotates by such an error, all links beyond it are displaced by the
// error times their distance from the joint. The errors of several joints are taken as independent, so their squares are added.
VectorXd SkeletonCoordinates::rounding(const VectorXd& q) const {
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<JointColumn> columns = this->columns(poses);
    // Sums over the joints on the path from the root, with w the error of the rotation about o and h the pitch, over epsilon: w^2,
    // w^2 (|o|^2 + h^2) and w^2 o.
    struct Sums {
        double one = 0.0, square = 0.0;
        Vec3 place = Vec3::Zero();
    };
    std::vector<Sums> all(n_links());
    VectorXd displacement(nodes().size());
    for (Index k = 0; k < n_links(); ++k) {
        const Joint& joint = joints_[k];
        Sums& sums = all[k];
        if (joint.parent >= 0) sums = all[joint.parent];
        if (joint.traits().rotates) {
            const double turn =
                rotation_round_off * poses[k].center.cwiseAbs().maxCoeff() / links_[k].length() + 1.0;
            const JointColumn& column = columns[first_[k]];
            sums.one += turn * turn;
            sums.place += turn * turn * column.origin;
            sums.square += turn * turn * (column.origin.squaredNorm() + column.pitch * column.pitch);
        }
        for (Index n = 0; n < links_[k].size(); ++n) {
            const Vec3 x = q.segment<3>(3 * links_[k].nodes()[n]);
            displacement[row_[k] + n] =
                std::sqrt(std::max(0.0, sums.square - 2.0 * x.dot(sums.place) + x.squaredNorm() * sums.one));
        }
    }
    return displacement;
}

std::vector<SkeletonCoordinates::Pose> SkeletonCoordinates::first_fit(const VectorXd& q) const {
    std::vector<Pose> fit;
    for (const RigidNodes& link : links_)
        fit.push_back(link.has_vertices() ? link.pose_of_vertices(q) : link.pose(q));
    return fit;
}

MatrixXd SkeletonCoordinates::leading(const MatrixXd& rows) const {
    MatrixXd picked(3 * leading_.size(), rows.cols());
    for (std::size_t k = 0; k < leading_.size(); ++k)
        picked.middleRows<3>(3 * k) = rows.middleRows<3>(3 * leading_[k]);
    return picked;
}

void SkeletonCoordinates::scatter_leading(const VectorXd& leading, VectorXd& rows) const {
    for (std::size_t k = 0; k < leading_.size(); ++k)
        rows.segment<3>(3 * leading_[k]) = leading.segment<3>(3 * k);
}

// Fits each link to its own vertices, puts the links onto their joints, then fits all coordinates to the leading nodes by Gauss-Newton
// iterations. The velocities are those of the coordinates z that fit the velocities of the leading nodes best.
void SkeletonCoordinates::project_state(VectorXd& q, VectorXd* v) const {
    const VectorXd given = leading(gather(q));
    move_links(q, first_fit(q), VectorXd::Zero(coordinates_));
    double before = std::numeric_limits<double>::infinity();
    for (int round = 0; round < max_fit_iterations && n_links() > 1; ++round) {
        const VectorXd off = given - leading(gather(q));
        if (!(off.norm() < before)) break;
        before = off.norm();
        const VectorXd z = LeastSquares(leading(jacobian(q))).solve(off);
        if (!(z.norm() > fit_tolerance * links_.front().length())) break;
        retract(q, z);
    }
    if (!v) return;
    const MatrixXd b = jacobian(q);
    scatter(b * LeastSquares(leading(b)).solve(leading(gather(*v))), *v);
}

// With B_l and v_l the rows of the leading nodes, project_state() returns v = B z with z = B_l^+ v_l (pseudoinverse). B depends on the
// pose; its derivative is d2x/dz2.
void SkeletonCoordinates::project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q,
                                            VectorXd& by_v, Gradient& out, VectorXd* by_rest) const {
    const MatrixXd b = jacobian(q), led = leading(b);
    const LeastSquares inverse(led.transpose() * led);
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
    if (leading_.size() <
        nodes().size()) {  // otherwise all nodes are given, and the gradient with respect to them stays
        VectorXd given = nothing;
        scatter_leading(led * inverse.solve(by_pose), given);
        scatter(gather(by_q) - given, by_state);
        scatter(given, by_q);
    }
    joint_parameters_vjp(q, by_state, rates, apart, out);
    if (by_rest) rest_vjp(q, by_state, rates, apart, *by_rest);
}

// Motors of joints: the distance of their coordinates from the targets, and the gradients with respect to the targets.

// A rotation takes the shorter way to its target, at most half a turn.
VectorXd SkeletonCoordinates::motor_increment(const VectorXd& q) const {
    if (motors_.empty()) return {};
    const std::vector<Pose> poses = this->poses(q);
    VectorXd increment = VectorXd::Zero(n_motor_coordinates());
    for (const Motor& motor : motors_) {
        const Index link = motor.link;
        const Joint& joint = joints_[link];
        const double length = links_[link].length(), rounds = poses[link].center.cwiseAbs().maxCoeff() +
                                                              length + unit(link) * motor.target.norm();
        const Vec3 off = joint.kind->motor_increment(joint, parent_side(link, poses), child_side(link, poses),
                                                     motor.target, length);
        if (off.norm() > motor_round_off * rounds)
            for (Index k = 0; k < joint.freedom(); ++k) increment[motor.first + k] = off[k];
    }
    return increment;
}

double SkeletonCoordinates::unit(Index link) const {
    return joints_[link].traits().has_lengths ? 1.0 : links_[link].length();
}

VectorXd SkeletonCoordinates::motor_units() const {
    VectorXd units(n_motor_coordinates());
    for (const Motor& motor : motors_)
        units.segment(motor.first, joints_[motor.link].freedom()).setConstant(unit(motor.link));
    return units;
}

void SkeletonCoordinates::motor_vjp(const VectorXd& q, const VectorXd& by_motors, Gradient& out) const {
    const VectorXd by_units = motor_units().cwiseProduct(by_motors);
    const std::vector<Pose> poses = this->poses(q);
    for (const Motor& motor : motors_) {
        const Joint& joint = joints_[motor.link];
        Vec3 by_coordinates = Vec3::Zero();
        for (Index c = 0; c < joint.freedom(); ++c) by_coordinates[c] = by_units[motor.first + c];
        const Vec3 by_target =
            joint.kind->target_gradient(frame(motor.link, poses), motor.target, by_coordinates);
        for (Index c = 0; c < joint.freedom(); ++c) out.values[motor.slice.first + c] += by_target[c];
    }
}

std::vector<Vec3> SkeletonCoordinates::ball_moments(const VectorXd& q, const VectorXd& gradient,
                                                    const VectorXd& z,
                                                    const std::vector<JointColumn>& columns) const {
    const VectorXd pull = twists(q).pull_back(gather(gradient));
    std::vector<Vec3> moments(n_links(), Vec3::Zero());
    for (Index k = 0; k < n_links(); ++k) {
        if (!joints_[k].traits().has_world_columns) continue;
        Vec3 rate, moment;
        for (int c = 0; c < 3; ++c) {
            const Index j = first_[k] + c, at = column_of_[j];
            rate[c] = columns[j].scale * z[at];
            moment[c] = pull[at] / columns[j].scale;
        }
        moments[k] = rate.cross(moment);
    }
    return moments;
}

VectorXd SkeletonCoordinates::motor_force_change(const VectorXd& q, const VectorXd& gradient,
                                                 const VectorXd& motor_rates) const {
    VectorXd z = VectorXd::Zero(coordinates_);
    z.tail(n_motor_coordinates_) = motor_rates;
    VectorXd change = second_derivative(q, gradient).transpose() * z;
    const std::vector<JointColumn> columns = this->columns(poses(q));
    const std::vector<Vec3> moments = ball_moments(q, gradient, z, columns);
    for (const Motor& motor : motors_) {
        if (!joints_[motor.link].traits().has_world_columns) continue;
        for (Index above = joints_[motor.link].parent; above >= 0; above = joints_[above].parent)
            for (Index a = first_[above]; a < first_[above] + joints_[above].freedom(); ++a)
                if (columns[a].is_rotation)
                    change[column_of_[a]] -= columns[a].scale * columns[a].axis.dot(moments[motor.link]);
    }
    return change;
}

// Gradients with respect to the origins, axes and numbers of joints. A change of an origin or axis leaves the reference positions of the
// links as they are; at given joint coordinates it displaces all links beyond the joint. The formulas for axes and numbers are those of the
// kinds (joint_kinds.cpp). With the rotations R of the parent link p and the child link k, their angular velocities w in the motion B z, the
// joint's coordinate s and its rate s', and the current position o of the joint:
//
//   origin, rotation            dx/do = R_p - R_k,      d(B z)/do = [w_p]x R_p - [w_k]x R_k;         for a translation they cancel
//   axis, translation by s      dx = s R_p da,          d(B z) = s w_p x R_p da + s' R_p da
//   axis, rotation by s         dx = u x (x - o),       d(B z) = u' x (x - o) + u x (B z - B z at o)
//                               u = R_p (sin s da + (1 - cos s) a x da),   u' = w_p x u + s' R_p (cos s da + sin s a x da)
//
// Axes are unit vectors, so da is perpendicular to a. The columns of ball joints beyond the joint are rotations about the world axes and do
// not rotate with u; this subtracts the moment of ball_moments(). Springs and dampers in the joint contribute nothing: they depend on s and
// s', which are fixed here.

bool SkeletonCoordinates::has_joint_parameters() const {
    return std::ranges::any_of(slices_,
                               [](const ParameterSlices& slices) { return slices.origin.size() > 0; });
}

void SkeletonCoordinates::SubtreeSums::add(const SubtreeSums& child) {
    by_translation += child.by_translation;
    force += child.force;
    by_rotation += child.by_rotation + (child.center - center).cross(child.by_translation) +
                   (child.velocity - velocity).cross(child.force);
    moment += child.moment + (child.center - center).cross(child.force);
}

std::vector<Vec3> SkeletonCoordinates::turning_rates(const VectorXd& z,
                                                     const std::vector<JointColumn>& columns) const {
    std::vector<Vec3> rates(n_links(), Vec3::Zero());
    for (Index k = 0; k < n_links(); ++k) {
        if (joints_[k].parent >= 0) rates[k] = rates[joints_[k].parent];
        for (Index j = first_[k]; j < first_[k] + joints_[k].freedom(); ++j)
            if (columns[j].is_rotation) rates[k] += columns[j].scale * z[column_of_[j]] * columns[j].axis;
    }
    return rates;
}

std::vector<SkeletonCoordinates::SubtreeSums> SkeletonCoordinates::subtree_sums(
    const VectorXd& q, const VectorXd& by_state, const VectorXd& z, const VectorXd& gradient,
    const std::vector<Pose>& poses, const std::vector<JointColumn>& columns) const {
    const VectorXd motion = twists(q).motion(z);
    const std::vector<Vec3> moments = ball_moments(q, gradient, z, columns),
                            rates = turning_rates(z, columns);
    std::vector<SubtreeSums> all(n_links());
    for (Index k = 0; k < n_links(); ++k) {
        SubtreeSums& own = all[k];
        own.center = poses[k].center;
        own.velocity = Vec3::Zero();
        own.by_rotation = -moments[k];
        for (Index n = row_[k]; n < row_[k] + RigidNodes::corners; ++n)
            own.velocity += motion.segment<3>(3 * n) / RigidNodes::corners;
        own.rate = rates[k];
        for (Index n = 0; n < links_[k].size(); ++n) {
            const Index node = links_[k].nodes()[n];
            const Vec3 arm = q.segment<3>(3 * node) - own.center, s = by_state.segment<3>(3 * node),
                       g = gradient.segment<3>(3 * node);
            own.by_translation += s;
            own.force += g;
            own.by_rotation += arm.cross(s) + (motion.segment<3>(3 * (row_[k] + n)) - own.velocity).cross(g);
            own.moment += arm.cross(g);
        }
    }
    for (Index k = n_links() - 1; k >= 0; --k)
        if (joints_[k].parent >= 0) all[joints_[k].parent].add(all[k]);
    return all;
}

void SkeletonCoordinates::add_joint_gradients(Index link, const SubtreeSums& sums, const Vec3& parent_rate,
                                              const VectorXd& z, const std::vector<Pose>& poses,
                                              const std::vector<JointColumn>& columns, Gradient& out) const {
    const Joint& joint = joints_[link];
    const ParameterSlices& slices = slices_[link];
    if (slices.axis.size() == 0 && slices.numbers.empty()) return;
    const JointSide parent = parent_side(link, poses);
    SubtreeSums about;
    about.center = parent.origin;
    about.velocity = sums.velocity + sums.rate.cross(about.center - sums.center);
    about.add(sums);
    const JointSums about_origin{
        parent.rotation.transpose(), parent_rate, sums.rate, about.by_translation, about.force,
        about.by_rotation,           about.moment};
    const double s = joint.kind->coordinate(joint, parent, child_side(link, poses)),
                 rate = columns[first_[link]].scale * z[column_of_[first_[link]]];
    for (std::size_t n = 0; n < slices.numbers.size(); ++n)
        out.values[slices.numbers[n].first] += joint.kind->number_gradient(joint, n, s, rate, about_origin);
    if (slices.axis.size() == 0) return;
    const Vec3& axis = joint.axis;
    const Vec3 by_axis = joint.kind->axis_gradient(joint, s, rate, about_origin);
    out.values.segment<3>(slices.axis.first) += by_axis - axis.dot(by_axis) * axis;
}

void SkeletonCoordinates::joint_parameters_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                                               const VectorXd& gradient, Gradient& out) const {
    if (!has_joint_parameters()) return;
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<JointColumn> columns = this->columns(poses);
    const std::vector<SubtreeSums> sums = subtree_sums(q, by_state, z, gradient, poses, columns);
    for (Index k = 0; k < n_links(); ++k) {
        const Joint& joint = joints_[k];
        const Vec3 parent_rate = joint.parent < 0 ? Vec3::Zero().eval() : sums[joint.parent].rate;
        const auto by_point = [&](const Mat3& turn, const Vec3& rate) -> Vec3 {
            return turn.transpose() * (sums[k].by_translation + sums[k].force.cross(rate));
        };
        if (slices_[k].origin.size() > 0 && joint.traits().rotates)
            out.values.segment<3>(slices_[k].origin.first) +=
                by_point(frame(k, poses), parent_rate) - by_point(poses[k].rotation, sums[k].rate);
        add_joint_gradients(k, sums[k], parent_rate, z, poses, columns, out);
    }
}

// The vertices of a link are at x = c + R (X - C), C the center at rest, and move by v + w x (x - c):  dx = R dX,  d(B z) = w x R dX.
void SkeletonCoordinates::rest_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                                   const VectorXd& gradient, VectorXd& by_nodes) const {
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<Vec3> rates = turning_rates(z, columns(poses));
    for (Index k = 0; k < n_links(); ++k)
        for (Index n = links_[k].own(); n < links_[k].size(); ++n) {
            const Index first = 3 * links_[k].nodes()[n];
            const Vec3 by_position = by_state.segment<3>(first) + gradient.segment<3>(first).cross(rates[k]);
            by_nodes.segment<3>(first) += poses[k].rotation.transpose() * by_position;
        }
}

}  // namespace magshell
