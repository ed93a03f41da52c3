#include "magshell/terms/contact/round_motion.h"

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

Mat3 cross_of(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

Vec3 node(const double* all, Index k) {
    return Eigen::Map<const Vec3>(all + 3 * k);
}

}  // namespace

RoundMotion::RoundMotion(const RoundInput& input, const Placement& placed, const CornerFrame& own,
                         const CornerFrame* other, const NearestPoint::DistanceAt& distance, const double* q)
    : own_(&own), other_(other), radius_(input.core.radius) {
    const CornerFrame::Pose pose = own.pose(q);
    const Mat3 turned = rotation(placed.rotation_vector);
    const Vec3 middle = turned * input.core.middle;
    const Mat3 half = turned * input.core.half;
    own_axes_ = pose.axes;
    const Vec3 from_mean = middle + placed.center - own.rest_center();
    nearest_ = NearestPoint(input.core, pose.center + pose.axes * from_mean, pose.axes * half, distance);
    for (int k = 0; k < nearest_.moving; ++k) {
        at_rest_[k] = half * nearest_.directions[k];
        along_[k] = pose.axes * at_rest_[k];
    }
    const Vec3 from_middle = half * nearest_.place;
    from_center_ = middle + from_middle;
    const Vec3 at_rest = from_mean + from_middle;
    for (int k = 0; k < corners; ++k) {
        own_levers_[k] = pose.axes * own.weight(k);
        weights_[k] = 0.25 + own.weight(k).dot(at_rest);
    }
    if (!other) return;
    const CornerFrame::Pose there = other->pose(q);
    arm_ = nearest_.point - there.center;
    for (int k = 0; k < corners; ++k) levers_[k] = there.axes * other->weight(k);
}

RoundMotion::Nodes RoundMotion::nodes(const CornerFrame& own, const CornerFrame* other) {
    Nodes all;
    all.fill(-1);
    std::copy(own.corners().begin(), own.corners().end(), all.begin());
    if (other) std::copy(other->corners().begin(), other->corners().end(), all.begin() + corners);
    return all;
}

RoundMotion RoundMotion::on_surface() const {
    RoundMotion there = *this;
    there.inset_ = radius_;
    return there;
}

Mat3 RoundMotion::jacobian(int place) const {
    if (place < corners) return weight(place) * Mat3::Identity();
    if (!other_) return Mat3::Zero();
    return levers_[place - corners] * arm().transpose() - 0.25 * Mat3::Identity();
}

Vec3 RoundMotion::motion(const double* all) const {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < corners; ++k) sum += weight(k) * node(all, own_->corners()[k]);
    for (int k = 0; k < corners && other_; ++k) {
        const Vec3 there = node(all, other_->corners()[k]);
        sum += levers_[k] * arm().dot(there) - 0.25 * there;
    }
    return sum;
}

Vec3 RoundMotion::reaction(int place, const Vec3& force) const {
    if (place < corners) return weight(place) * force;
    if (!other_) return Vec3::Zero();
    return arm() * levers_[place - corners].dot(force) - 0.25 * force;
}

Vec3 RoundMotion::sliding(int direction, int place) const {
    const Vec3& along = along_[direction];
    const Vec3 bent = nearest_.at.curvature * along;
    if (place < corners) return weights_[place] * bent + own_levers_[place].dot(along) * normal();
    if (!other_) return Vec3::Zero();
    const Vec3& lever = levers_[place - corners];
    return arm_ * lever.dot(bent) - 0.25 * bent + lever.dot(normal()) * along;
}

Mat3 RoundMotion::hessian(int i, int j, double force, double stiffness) const {
    const Vec3& n = normal();
    Mat3 sum = jacobian(i).transpose() * (stiffness * n * n.transpose() - force * nearest_.at.curvature) *
               jacobian(j);
    // The obstacle turns with its rigid body: the second derivative of R^T (x - c), times n.
    const auto turning = [&](int place) { return place < corners ? 0.0 : levers_[place - corners].dot(n); };
    const auto share = [&](int place) { return place < corners ? weights_[place] : -0.25; };
    if (other_) sum -= force * (turning(i) * share(j) + turning(j) * share(i)) * Mat3::Identity();
    for (int k = 0; k < nearest_.moving; ++k)
        sum += force / nearest_.stretches[k] * sliding(k, i) * sliding(k, j).transpose();
    return sum;
}

// The force on the nodes is G^T f(N, n, u) with u = G v at p, of which all change with the positions: N and n as the gap does, p = x - r n, the
// weights a_k by w_k . H dt - r d(R w_k . n), and R of both bodies by dR w_k = sum_j (w_j . w_k) dx_j.
RoundMotion::Blocks RoundMotion::by_positions(const Friction& friction, double stiffness, const Vec3& spin,
                                              const VectorXd& v) const {
    const Vec3 there = arm();
    const int used = other_ ? places : corners;
    const auto velocity = [&](int k) -> Vec3 {
        return node(v.data(), k < corners ? own_->corners()[k] : other_->corners()[k - corners]);
    };
    std::array<Mat3, places> force, arm_change;                   // df/dx, d(p - c)/dx
    std::array<std::array<Vec3, corners>, places> weight_change;  // d a_k/dx
    for (int j = 0; j < used; ++j) {
        const bool is_own = j < corners;
        std::array<Vec3, 2> slopes;  // dt/dx along the directions
        Mat3 slid = Mat3::Zero();
        for (int k = 0; k < nearest_.moving; ++k) {
            slopes[k] = -sliding(k, j) / nearest_.stretches[k];
            slid += along_[k] * slopes[k].transpose();
        }
        Mat3 relative = is_own ? Mat3(weights_[j] * Mat3::Identity())
                               : Mat3(levers_[j - corners] * arm_.transpose() - 0.25 * Mat3::Identity());
        const Vec3 depth = relative.transpose() * normal();
        Mat3 tilt = nearest_.at.curvature * (relative + slid);  // dn/dx
        if (!is_own) tilt += levers_[j - corners].dot(normal()) * Mat3::Identity();
        Mat3 place = slid - inset_ * tilt;
        if (is_own) place += weights_[j] * Mat3::Identity();
        arm_change[j] = is_own ? place : Mat3(place - 0.25 * Mat3::Identity());
        Mat3 relative_velocity = -cross_of(spin) * place;
        for (int k = 0; k < corners; ++k) {
            Vec3 turned = tilt.transpose() * own_levers_[k];
            if (is_own) turned += own_->weight(j).dot(own_->weight(k)) * normal();
            weight_change[j][k] = -inset_ * turned;
            for (int m = 0; m < nearest_.moving; ++m)
                weight_change[j][k] += own_->weight(k).dot(at_rest_[m]) * slopes[m];
            relative_velocity += velocity(k) * weight_change[j][k].transpose();
        }
        for (int k = 0; k < corners && other_; ++k) {
            const Vec3 moved = velocity(corners + k);
            relative_velocity += levers_[k] * (arm_change[j].transpose() * moved).transpose();
            if (!is_own)
                relative_velocity +=
                    other_->weight(j - corners).dot(other_->weight(k)) * there.dot(moved) * Mat3::Identity();
        }
        force[j] = -stiffness * friction.by_normal_force * depth.transpose() + friction.by_normal * tilt +
                   friction.by_velocity * relative_velocity;
    }
    Blocks blocks(places * places, Mat3::Zero());
    for (int i = 0; i < used; ++i)
        for (int j = 0; j < used; ++j) {
            Mat3& sum = blocks[places * i + j];
            sum = jacobian(i).transpose() * force[j];
            if (i < corners) {
                sum += friction.force * weight_change[j][i].transpose();
            } else {
                sum += levers_[i - corners].dot(friction.force) * arm_change[j];
                if (j >= corners)
                    sum += other_->weight(i - corners).dot(other_->weight(j - corners)) * there *
                           friction.force.transpose();
            }
        }
    return blocks;
}

void RoundMotion::add(const Blocks& blocks, double factor, NonsymmetricTangent& out) const {
    const Nodes all = nodes();
    // Blocks of four nodes: each body with itself, and two corners of one with two of the other.
    const auto add = [&](const std::array<int, 4>& at, bool between) {
        NonsymmetricTangent::PairBlock& pair = out.append_pair();
        for (int a = 0; a < 4; ++a) {
            pair.nodes[a] = all[at[a]];
            for (int b = 0; b < 4; ++b) {
                const bool wanted = !between || (at[a] < corners) != (at[b] < corners);
                pair.blocks[4 * a + b] =
                    wanted ? Mat3(factor * blocks[places * at[a] + at[b]]) : Mat3(Mat3::Zero());
            }
        }
    };
    add({0, 1, 2, 3}, false);
    if (!other_) return;
    add({4, 5, 6, 7}, false);
    for (int a = 0; a < corners; a += 2)
        for (int b = corners; b < places; b += 2) add({a, a + 1, b, b + 1}, true);
}

RoundMotion::ByObstacle RoundMotion::vjp(const Slopes& slopes, double stiffness, const Placement& placed,
                                         Placement& by_shape) const {
    Vec3 by_normal = slopes.by_normal, by_rest = Vec3::Zero(), by_point = Vec3::Zero();
    const auto at = [](const double* all, Index k) { return all ? node(all, k) : Vec3(Vec3::Zero()); };
    for (int k = 0; k < corners; ++k) {
        const Index corner = own_->corners()[k];
        const double by_weight =
            slopes.by_velocity.dot(at(slopes.v, corner)) + slopes.by_motion.dot(at(slopes.lambda, corner));
        by_rest += by_weight * own_->weight(k);
        by_normal -= inset_ * by_weight * own_levers_[k];
    }
    for (int k = 0; k < corners && other_; ++k) {
        const Index corner = other_->corners()[k];
        by_point += levers_[k].dot(slopes.by_velocity) * at(slopes.v, corner) +
                    levers_[k].dot(slopes.by_motion) * at(slopes.lambda, corner);
    }
    by_point -= slopes.by_velocity.cross(slopes.spin);
    by_normal -= inset_ * by_point;
    const double by_distance = -stiffness * slopes.by_force;
    const Vec3 by_place = by_point + nearest_.at.curvature * by_normal;  // of x, along the directions
    Vec3 turning = Vec3::Zero();                                         // of R H d
    for (int k = 0; k < nearest_.moving; ++k) {
        const double scale = -(by_rest.dot(at_rest_[k]) + by_place.dot(along_[k])) / nearest_.stretches[k];
        by_normal += scale * along_[k];
        turning += at_rest_[k].cross(own_axes_.transpose() * (scale * normal()));
    }
    const Vec3 by_x = by_point + by_distance * normal() + nearest_.at.curvature * by_normal;
    by_rest += own_axes_.transpose() * by_x;
    by_shape.center += by_rest;
    by_shape.rotation_vector +=
        transposed_jacobian_times(placed.rotation_vector, from_center_.cross(by_rest) + turning);
    return {by_distance, by_normal};
}

}  // namespace magshell
