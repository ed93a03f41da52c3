#include "magshell/term/body_friction_term.h"

#include <algorithm>
#include <utility>

namespace magshell {

void BodyFrictionTerm::begin_step(const VectorXd& q, const Controls&) {
    before_.clear();
    if (std::none_of(lagged_.begin(), lagged_.end(), [](bool lagged) { return lagged; })) return;
    for (const Touch& touch : contact_.touches(q.data()))
        if (lagged_[touch.near.contact]) before_.push_back(touch);
    contact_.keep_coupled(before_);
}

void BodyFrictionTerm::evaluate(const Kinematics& at, const Controls&, Residual& out) {
    rubbing_.clear();
    now_ = holds_ ? held_ : contact_.touching();
    const auto rub = [&](const Touch& touch, bool lagged) {
        if (!rubs_[touch.near.contact] || lagged_[touch.near.contact] != lagged) return;
        rubbing_.push_back(
            {&touch, lagged,
             PairFriction(touch.at, places_of(touch.near.pair, at.v.data()), contact_.friction(touch))});
        const PairVectors force = rubbing_.back().friction.force();
        for (int k = 0; k < touch.at.count(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * touch.near.pair.nodes[k] + axis, -force[k][axis]);
    };
    for (const Touch& touch : now_) rub(touch, false);
    for (const Touch& touch : before_) rub(touch, true);
}

void BodyFrictionTerm::hold(bool held) {
    if (held) held_ = contact_.touching();
    holds_ = held;
    contact_.keep_coupled(held ? held_ : before_);
}

void BodyFrictionTerm::assemble(const Kinematics& at, const Controls&, bool cautious, SystemMatrix&,
                                NonsymmetricTangent& rest) const {
    for (const Rub& each : rubbing_) {
        const std::array<Index, 4>& nodes = each.touch->near.pair.nodes;
        contact_.layer().add(nodes, [&](int i, int j) -> Mat3 {
            return -at.rate * each.friction.by_velocity(i, j, cautious);
        });
        if (each.lagged || holds_) continue;
        NonsymmetricTangent::PairBlock& pair = rest.append_pair();
        pair.nodes = nodes;
        each.friction.by_place(pair.blocks);
        for (Mat3& block : pair.blocks) block *= -1.0;
    }
}

void BodyFrictionTerm::add_stiffness(const Kinematics& at, std::vector<PairStiffness>& out) const {
    for (const Rub& each : rubbing_)
        out.push_back({each.touch->near.pair.nodes, each.touch->at.count(), each.touch->at.near().weights,
                       -at.rate * each.friction.friction().secant});
}

void BodyFrictionTerm::vjp(const Kinematics&, const Controls&, const VectorXd& lambda, KinematicsGradient& by,
                           Gradient& out) const {
    for (const Rub& each : rubbing_) {
        const Touch& touch = *each.touch;
        const PairFriction::Gradient of = each.friction.vjp(places_of(touch.near.pair, lambda.data()));
        for (int k = 0; k < touch.at.count(); ++k) {
            const Index first = 3 * touch.near.pair.nodes[k];
            by.velocity.segment<3>(first) += of.by_velocity[k];
            if (each.lagged) by.begin.segment<3>(first) += of.by_place[k];
        }
        const PairVectors none = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
        contact_.add_vjp(touch, touch.at.vjp(none, -of.by_normal_force),
                         {-of.by_law.kinetic, -of.by_law.fixed, -of.by_law.sticking_speed}, out.values);
    }
}

// A velocity is the difference of two places over a stage, and in what sticks a small one makes a large force.
void BodyFrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const Rub& each : rubbing_) {
        const double stiffness = at.rate * each.friction.friction().by_velocity.norm() * each.touch->far;
        const Proximity& near = each.touch->at.near();
        for (int k = 0; k < each.touch->at.count(); ++k)
            out.segment<3>(3 * each.touch->near.pair.nodes[k]).array() +=
                std::abs(near.weights[k]) * stiffness;
    }
}

}  // namespace magshell
