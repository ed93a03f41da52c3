#include "magshell/terms/contact/round_motion.h"

#include <cmath>

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

constexpr double place_accuracy = 1e-15;  // [-] of t
constexpr int max_searches = 200;         // a bisection ends after 51

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
                         const CornerFrame* other, const DistanceAt& distance, const double* q)
    : own_(&own), other_(other), radius_(input.radius), crown_(input.crown) {
    const CornerFrame::Pose pose = own.pose(q);
    const Mat3 turned = rotation(placed.rotation_vector);
    const Vec3 middle = turned * input.middle;
    half_at_rest_ = turned * input.half;
    own_axes_ = pose.axes;
    along_ = pose.axes * half_at_rest_;
    const Vec3 from_mean = middle + placed.center - own.rest_center();
    const Vec3 at_middle = pose.center + pose.axes * from_mean;
    const auto slope = [&](double t) {
        at_ = distance(at_middle + t * along_);
        return at_.normal.dot(along_) + crown_ * t;
    };
    if (along_.isZero(0.0)) {
        at_ = distance(at_middle);
    } else if (slope(-1.0) >= 0.0) {
        place_ = -1.0;
    } else if (slope(1.0) <= 0.0) {
        place_ = 1.0;
    } else {
        // Newton's method on the slope, which grows with t; a bisection where it does not halve the slope.
        double low = -1.0, high = 1.0, before = INFINITY;
        for (int k = 0; k < max_searches; ++k) {
            const double now = slope(place_);
            stretch_ = along_.dot(at_.curvature * along_) + crown_;
            (now > 0.0 ? high : low) = place_;
            double next = place_ - now / stretch_;
            if (!(stretch_ > 0.0 && std::abs(now) < 0.5 * before && next > low && next < high))
                next = 0.5 * (low + high);
            before = std::abs(now);
            if (now == 0.0 || std::abs(next - place_) < place_accuracy || high - low < place_accuracy) break;
            place_ = next;
        }
    }
    from_center_ = middle + place_ * half_at_rest_;
    const Vec3 at_rest = from_mean + place_ * half_at_rest_;
    point_ = at_middle + place_ * along_;
    for (int k = 0; k < corners; ++k) {
        own_levers_[k] = pose.axes * own.weight(k);
        weights_[k] = 0.25 + own.weight(k).dot(at_rest);
    }
    if (!other) return;
    const CornerFrame::Pose there = other->pose(q);
    arm_ = point_ - there.center;
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

Vec3 RoundMotion::sliding(int place) const {
    const Vec3 bent = at_.curvature * along_;
    if (place < corners) return weights_[place] * bent + own_levers_[place].dot(along_) * at_.normal;
    if (!other_) return Vec3::Zero();
    const Vec3& lever = levers_[place - corners];
    return arm_ * lever.dot(bent) - 0.25 * bent + lever.dot(at_.normal) * along_;
}

Mat3 RoundMotion::hessian(int i, int j, double force, double stiffness) const {
    const Vec3& n = at_.normal;
    Mat3 sum =
        jacobian(i).transpose() * (stiffness * n * n.transpose() - force * at_.curvature) * jacobian(j);
    // The obstacle turns with its rigid body: the second derivative of R^T (x - c), times n.
    const auto turning = [&](int place) { return place < corners ? 0.0 : levers_[place - corners].dot(n); };
    const auto share = [&](int place) { return place < corners ? weights_[place] : -0.25; };
    if (other_) sum -= force * (turning(i) * share(j) + turning(j) * share(i)) * Mat3::Identity();
    if (moves_along()) sum += force / stretch_ * sliding(i) * sliding(j).transpose();
    return sum;
}

// The force on the nodes is G^T f(N, n, u) with u = G v at p, of which all change with the positions: N and n as the gap does, p = x - r n, the
// weights a_k by w_k . h dt - r d(R w_k . n), and R of both bodies by dR w_k = sum_j (w_j . w_k) dx_j.
void RoundMotion::add_friction(const Friction& friction, double stiffness, const Vec3& spin, double factor,
                               const VectorXd& v, NonsymmetricTangent& out) const {
    const Vec3 there = arm();
    const int used = other_ ? places : corners;
    const auto velocity = [&](int k) -> Vec3 {
        return node(v.data(), k < corners ? own_->corners()[k] : other_->corners()[k - corners]);
    };
    std::array<Mat3, places> force, arm_change;                   // df/dx, d(p - c)/dx
    std::array<std::array<Vec3, corners>, places> weight_change;  // d a_k/dx
    for (int j = 0; j < used; ++j) {
        const bool is_own = j < corners;
        const Vec3 slope = moves_along() ? Vec3(-sliding(j) / stretch_) : Vec3(Vec3::Zero());  // dt/dx
        const Mat3 slid = along_ * slope.transpose();
        Mat3 relative = is_own ? Mat3(weights_[j] * Mat3::Identity())
                               : Mat3(levers_[j - corners] * arm_.transpose() - 0.25 * Mat3::Identity());
        const Vec3 depth = relative.transpose() * at_.normal;
        Mat3 normal = at_.curvature * (relative + slid);
        if (!is_own) normal += levers_[j - corners].dot(at_.normal) * Mat3::Identity();
        Mat3 place = slid - inset_ * normal;
        if (is_own) place += weights_[j] * Mat3::Identity();
        arm_change[j] = is_own ? place : Mat3(place - 0.25 * Mat3::Identity());
        Mat3 relative_velocity = -cross_of(spin) * place;
        for (int k = 0; k < corners; ++k) {
            Vec3 turned = normal.transpose() * own_levers_[k];
            if (is_own) turned += own_->weight(j).dot(own_->weight(k)) * at_.normal;
            weight_change[j][k] = own_->weight(k).dot(half_at_rest_) * slope - inset_ * turned;
            relative_velocity += velocity(k) * weight_change[j][k].transpose();
        }
        for (int k = 0; k < corners && other_; ++k) {
            const Vec3 moved = velocity(corners + k);
            relative_velocity += levers_[k] * (arm_change[j].transpose() * moved).transpose();
            if (!is_own)
                relative_velocity +=
                    other_->weight(j - corners).dot(other_->weight(k)) * there.dot(moved) * Mat3::Identity();
        }
        force[j] = -stiffness * friction.by_normal_force * depth.transpose() + friction.by_normal * normal +
                   friction.by_velocity * relative_velocity;
    }
    const auto block = [&](int i, int j) -> Mat3 {
        Mat3 sum = jacobian(i).transpose() * force[j];
        if (i < corners) {
            sum += friction.force * weight_change[j][i].transpose();
        } else {
            sum += levers_[i - corners].dot(friction.force) * arm_change[j];
            if (j >= corners)
                sum += other_->weight(i - corners).dot(other_->weight(j - corners)) * there *
                       friction.force.transpose();
        }
        return factor * sum;
    };
    const Nodes all = nodes();
    // Blocks of four nodes: each body with itself, and two corners of one with two of the other.
    const auto add = [&](const std::array<int, 4>& at, bool between) {
        NonsymmetricTangent::PairBlock& pair = out.append_pair();
        for (int a = 0; a < 4; ++a) {
            pair.nodes[a] = all[at[a]];
            for (int b = 0; b < 4; ++b) {
                const bool wanted = !between || (at[a] < corners) != (at[b] < corners);
                pair.blocks[4 * a + b] = wanted ? block(at[a], at[b]) : Mat3(Mat3::Zero());
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
    Vec3 by_along = Vec3::Zero();
    if (moves_along()) {
        const double by_place =
            by_rest.dot(half_at_rest_) + (by_point + at_.curvature * by_normal).dot(along_);
        const double scale = -by_place / stretch_;
        by_normal += scale * along_;
        by_along = scale * at_.normal;
    }
    const Vec3 by_x = by_point + by_distance * at_.normal + at_.curvature * by_normal;
    by_rest += own_axes_.transpose() * by_x;
    by_shape.center += by_rest;
    by_shape.rotation_vector += transposed_jacobian_times(
        placed.rotation_vector,
        from_center_.cross(by_rest) + half_at_rest_.cross(own_axes_.transpose() * by_along));
    return {by_distance, by_normal};
}

}  // namespace magshell
