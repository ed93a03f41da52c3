#include "magshell/terms/contact/body_friction_term.h"

#include <algorithm>
#include <utility>

namespace magshell {

void BodyFrictionTerm::begin_step(const VectorXd& q, const LoadParameters&) {
    before_.clear();
    if (std::none_of(lagged_.begin(), lagged_.end(), [](bool lagged) { return lagged; })) return;
    for (const ActiveContact& active : contact_.active_contacts(q.data()))
        if (lagged_[active.near.contact]) before_.push_back(active);
    contact_.set_extra_couplings(before_);
}

void BodyFrictionTerm::evaluate(const Kinematics& at, const LoadParameters&, Residual& out) {
    friction_contacts_.clear();
    now_ = frozen_ ? frozen_contacts_ : contact_.evaluated_contacts();
    const auto add_friction = [&](const ActiveContact& active, bool lagged) {
        if (!has_friction_[active.near.contact] || lagged_[active.near.contact] != lagged) return;
        // Lagged normal forces are those of the beginning of the step, without the factor of the contact forces.
        const double factor = lagged ? contact_.factor() : 1.0;
        FrictionLaw law = contact_.friction(active);
        law.kinetic *= factor;
        law.fixed *= factor;
        friction_contacts_.push_back(
            {&active, lagged, factor,
             PairFriction(active.at, positions_of(active.near.pair, at.v.data()), law)});
        const PairVectors force = friction_contacts_.back().friction.force();
        for (int k = 0; k < active.at.count(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * active.near.pair.nodes[k] + axis, -force[k][axis]);
    };
    for (const ActiveContact& active : now_) add_friction(active, false);
    for (const ActiveContact& active : before_) add_friction(active, true);
}

void BodyFrictionTerm::set_frozen(bool frozen) {
    if (frozen) frozen_contacts_ = contact_.evaluated_contacts();
    frozen_ = frozen;
    contact_.set_extra_couplings(frozen ? frozen_contacts_ : before_);
}

void BodyFrictionTerm::assemble(const Kinematics& at, const LoadParameters&, bool positive_definite,
                                SystemMatrix&, NonsymmetricTangent& rest) const {
    for (const FrictionContact& each : friction_contacts_) {
        const std::array<Index, 4>& nodes = each.active->near.pair.nodes;
        contact_.layer().add(nodes, [&](int i, int j) -> Mat3 {
            return -at.rate * each.friction.by_velocity(i, j, positive_definite);
        });
        if (each.lagged || frozen_) continue;
        NonsymmetricTangent::PairBlock& pair = rest.append_pair();
        pair.nodes = nodes;
        each.friction.by_position(pair.blocks);
        for (Mat3& block : pair.blocks) block *= -1.0;
    }
}

void BodyFrictionTerm::add_stiffness(const Kinematics& at, std::vector<PairStiffness>& out) const {
    for (const FrictionContact& each : friction_contacts_)
        out.push_back({each.active->near.pair.nodes, each.active->at.count(), each.active->at.near().weights,
                       -at.rate * each.friction.friction().secant});
}

void BodyFrictionTerm::vjp(const Kinematics&, const LoadParameters&, const VectorXd& lambda,
                           KinematicsGradient& by, Gradient& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const ActiveContact& active = *each.active;
        const PairFriction::Gradient of = each.friction.vjp(positions_of(active.near.pair, lambda.data()));
        for (int k = 0; k < active.at.count(); ++k) {
            const Index first = 3 * active.near.pair.nodes[k];
            by.velocity.segment<3>(first) += of.by_velocity[k];
            if (each.lagged) by.begin.segment<3>(first) += of.by_position[k];
        }
        const PairVectors none = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
        contact_.add_vjp(
            active, active.at.vjp(none, -of.by_normal_force),
            {-each.factor * of.by_law.kinetic, -each.factor * of.by_law.fixed, -of.by_law.sticking_speed},
            each.lagged ? 1.0 : contact_.factor(), out.values);
    }
}

// Bounds round-off: a velocity is the difference of two positions over a stage, and in a sticking contact a
// small velocity causes a large force.
void BodyFrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const double stiffness = at.rate * each.friction.friction().by_velocity.norm() * each.active->far;
        const Proximity& near = each.active->at.near();
        for (int k = 0; k < each.active->at.count(); ++k)
            out.segment<3>(3 * each.active->near.pair.nodes[k]).array() +=
                std::abs(near.weights[k]) * stiffness;
    }
}

}  // namespace magshell
