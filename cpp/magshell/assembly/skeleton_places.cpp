// Gradients by where joints are and along which axes. Links keep their places at rest as a joint is moved or turned; later,
// at the same coordinates, all that it carries goes somewhere else. With the turns R of its two links, the rates w at which
// z turns them, and o where the joint is now:
//
//   origin of a turn    dx/do = R_p - R_k,      d(B z)/do = [w_p]x R_p - [w_k]x R_k;         of a slide they cancel
//   axis of a slide s   dx = s R_p da,          d(B z) = s w_p x R_p da + s' R_p da
//   axis of a turn s    dx = u x (x - o),       d(B z) = u' x (x - o) + u x (B z - B z at o)
//                       u = R_p (sin s da + (1 - cos s) a x da),   u' = w_p x u + s' R_p (cos s da + sin s a x da)
//
// Axes are unit vectors, so da is across a. Columns of ball joints further on stay along the world's axes, which takes a
// couple off that is nothing where B^T g is zero. What acts in a joint knows its axis too, but with u, and
// with s and its rate fixed, its coordinate and that one's rate stay as they are.
#include <algorithm>
#include <cmath>

#include "magshell/assembly/skeleton_carrier.h"

namespace magshell {

bool SkeletonCarrier::placed() const {
    return std::ranges::any_of(
        slots_, [](const Slots& slots) { return slots.origin.size() > 0 || slots.axis.size() > 0; });
}

void SkeletonCarrier::Beyond::take(const Beyond& later) {
    slide += later.slide;
    force += later.force;
    twist += later.twist + (later.center - center).cross(later.slide) +
             (later.velocity - velocity).cross(later.force);
    moment += later.moment + (later.center - center).cross(later.force);
}

std::vector<SkeletonCarrier::Beyond> SkeletonCarrier::beyond(const VectorXd& q, const VectorXd& by_state,
                                                             const VectorXd& z, const VectorXd& gradient,
                                                             const std::vector<Pose>& poses,
                                                             const std::vector<Column>& columns) const {
    const VectorXd motion = twists(q).motion(z);
    const std::vector<Vec3> couples = ball_couples(q, gradient, z, columns);
    std::vector<Beyond> all(n_links());
    for (Index k = 0; k < n_links(); ++k) {
        Beyond& own = all[k];
        own.center = poses[k].center;
        own.velocity = Vec3::Zero();
        own.twist = -couples[k];
        for (Index n = row_[k]; n < row_[k] + RigidNodes::corners; ++n)
            own.velocity += motion.segment<3>(3 * n) / RigidNodes::corners;
        if (joints_[k].parent >= 0) own.rate = all[joints_[k].parent].rate;
        for (Index j = first_[k]; j < first_[k] + joints_[k].freedom(); ++j)
            if (columns[j].turns) own.rate += columns[j].share * z[place_[j]] * columns[j].axis;
        for (Index n = 0; n < links_[k].size(); ++n) {
            const Index node = links_[k].nodes()[n];
            const Vec3 arm = q.segment<3>(3 * node) - own.center, s = by_state.segment<3>(3 * node),
                       g = gradient.segment<3>(3 * node);
            own.slide += s;
            own.force += g;
            own.twist += arm.cross(s) + (motion.segment<3>(3 * (row_[k] + n)) - own.velocity).cross(g);
            own.moment += arm.cross(g);
        }
    }
    for (Index k = n_links() - 1; k >= 0; --k)
        if (joints_[k].parent >= 0) all[joints_[k].parent].take(all[k]);
    return all;
}

Vec3 SkeletonCarrier::axis_gradient(Index link, const Beyond& of, const Vec3& parent_rate, const VectorXd& z,
                                    const std::vector<Pose>& poses,
                                    const std::vector<Column>& columns) const {
    const Vec3& axis = joints_[link].axis;
    const Mat3 to_parent = frame(link, poses).transpose();
    const Column& column = columns[first_[link]];
    const double s = coordinate(link, poses), rate = column.share * z[place_[first_[link]]];
    Vec3 by_axis;
    if (column.turns) {
        Beyond about;
        about.center = joint_place(link, poses);
        about.velocity = of.velocity + of.rate.cross(about.center - of.center);
        about.take(of);
        const Vec3 by_turn = to_parent * (about.twist + about.moment.cross(parent_rate)),
                   by_rate = rate * (to_parent * about.moment);
        by_axis = std::sin(s) * by_turn + (1.0 - std::cos(s)) * by_turn.cross(axis) + std::cos(s) * by_rate +
                  std::sin(s) * by_rate.cross(axis);
    } else
        by_axis = to_parent * (s * (of.slide + of.force.cross(parent_rate)) + rate * of.force);
    return by_axis - axis.dot(by_axis) * axis;
}

void SkeletonCarrier::places_vjp(const VectorXd& q, const VectorXd& by_state, const VectorXd& z,
                                 const VectorXd& gradient, Gradient& out) const {
    if (!placed()) return;
    const std::vector<Pose> poses = this->poses(q);
    const std::vector<Column> columns = this->columns(poses);
    const std::vector<Beyond> sums = beyond(q, by_state, z, gradient, poses, columns);
    for (Index k = 0; k < n_links(); ++k) {
        const Joint& joint = joints_[k];
        const Vec3 parent_rate = joint.parent < 0 ? Vec3::Zero().eval() : sums[joint.parent].rate;
        const auto by_point = [&](const Mat3& turn, const Vec3& rate) -> Vec3 {
            return turn.transpose() * (sums[k].slide + sums[k].force.cross(rate));
        };
        if (slots_[k].origin.size() > 0 &&
            (joint.kind == JointKind::revolute || joint.kind == JointKind::ball))
            out.values.segment<3>(slots_[k].origin.first) +=
                by_point(frame(k, poses), parent_rate) - by_point(poses[k].rotation, sums[k].rate);
        if (slots_[k].axis.size() > 0 && joint.has_axis())
            out.values.segment<3>(slots_[k].axis.first) +=
                axis_gradient(k, sums[k], parent_rate, z, poses, columns);
    }
}

}  // namespace magshell
