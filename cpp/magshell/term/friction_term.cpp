#include "magshell/term/friction_term.h"

#include <algorithm>

namespace magshell {
namespace {

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

// df/dx of the whole dependence on the place, but for the coefficient: through N, n and the body's velocity.
Mat3 by_place(const Friction& friction, const ContactTerm::Touch& touch, const Vec3& spin) {
    return -touch.stiffness * friction.by_normal_force * touch.at.normal.transpose() +
           friction.by_normal * touch.at.curvature - friction.by_velocity * cross_matrix(spin);
}

}  // namespace

void FrictionTerm::begin_step(const VectorXd& q, const Controls& controls) {
    before_.clear();
    controls_before_ = controls;
    if (std::none_of(lagged_.begin(), lagged_.end(), [](bool lagged) { return lagged; })) return;
    for (const ContactTerm::Touch& touch : contact_.touches(q.data(), controls))
        if (lagged_[touch.contact]) before_.push_back(touch);
}

void FrictionTerm::evaluate(const Kinematics& at, const Controls& controls, Residual& out) {
    rubbing_.clear();
    const auto rub = [&](const ContactTerm::Touch& touch, bool lagged) {
        const StandingObstacle obstacle =
            contact_.standing(touch.obstacle, lagged ? controls_before_ : controls);
        const Vec3 velocity = contact_.at_point(touch, at.v.data()) - obstacle.velocity(touch.place);
        const ContactLaw& law = contact_.law(touch);
        rubbing_.push_back(
            {touch, lagged, obstacle, Friction(touch.force, touch.at.normal, velocity, law.sticking_speed)});
        contact_.spread(touch, -law.friction * rubbing_.back().friction.force, out);
    };
    for (const ContactTerm::Touch& touch : holds_ ? held_ : contact_.touching())
        if (rubs_[touch.contact] && !lagged_[touch.contact]) rub(touch, false);
    for (const ContactTerm::Touch& touch : before_)
        if (rubs_[touch.contact]) rub(touch, true);
}

void FrictionTerm::hold(bool held) {
    if (held) held_ = contact_.touching();
    holds_ = held;
}

void FrictionTerm::assemble(const Kinematics& at, const Controls&, bool cautious, SystemMatrix& out,
                            NonsymmetricTangent& rest) const {
    for (const Rub& each : rubbing_) {
        const double coefficient = contact_.law(each.touch).friction;
        const Mat3& by_velocity = cautious ? each.friction.secant : each.friction.by_velocity;
        contact_.add_block(each.touch, -coefficient * at.rate * by_velocity, out);
        if (each.lagged || holds_) continue;
        const Mat3 block = -coefficient * by_place(each.friction, each.touch, each.obstacle.spin());
        const ContactPoint& point = contact_.point(each.touch);
        if (point.nodes[1] < 0) {
            rest.add(point.nodes[0], block);
            continue;
        }
        NonsymmetricTangent::FaceBlock shared{point.nodes, point.weights, {}};
        for (int k = 0; k < 3; ++k) shared.block.middleCols<3>(3 * k) = point.weights[k] * block;
        rest.add(shared);
    }
}

void FrictionTerm::vjp(const Kinematics&, const Controls&, const VectorXd& lambda, KinematicsGradient& by,
                       Gradient& out) const {
    for (const Rub& each : rubbing_) {
        const ContactTerm::Touch& touch = each.touch;
        const Friction& friction = each.friction;
        const ContactLaw& law = contact_.law(touch);
        const Vec3 along = contact_.at_point(touch, lambda.data());
        const Vec3 by_velocity = law.friction * (friction.by_velocity * along);
        contact_.spread(touch, by_velocity, by.velocity);
        if (each.lagged) {
            const Mat3 by_begin = law.friction * by_place(friction, touch, each.obstacle.spin());
            contact_.spread(touch, by_begin.transpose() * along, by.begin);
        }
        const double by_force = -law.friction * along.dot(friction.by_normal_force);
        ObstacleGradient by_obstacle;
        each.obstacle.vjp(touch.place, touch.at, -touch.stiffness * by_force,
                          -law.friction * (friction.by_normal.transpose() * along), -by_velocity,
                          by_obstacle);
        contact_.add_vjp(touch, by_force,
                         {.friction = -along.dot(friction.force),
                          .sticking_speed = -law.friction * along.dot(friction.by_sticking_speed)},
                         by_obstacle, out.values, each.lagged ? by.begin_controls : out.controls);
    }
}

// A velocity is the difference of two places over a stage, and in what sticks a small one makes a large force.
void FrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const Rub& each : rubbing_) {
        const double stiffness = at.rate * each.friction.by_velocity.norm();
        contact_.add_cancelling_force(each.touch, contact_.law(each.touch).friction * stiffness, out);
    }
}

}  // namespace magshell
