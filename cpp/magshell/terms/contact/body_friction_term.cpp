#include "magshell/terms/contact/body_friction_term.h"

namespace magshell {
namespace {

// The motion of a pair for derivatives with respect to the normal force alone.
const PairVectors no_motion = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};

}  // namespace

void BodyFrictionTerm::begin_step(const VectorXd& q, const LoadParameters&) {
    if (contacts_.begin_step([&] { return contact_.active_contacts(q.data()); }))
        contact_.set_extra_couplings(contacts_.at_begin());
}

void BodyFrictionTerm::evaluate(const Kinematics& at, const LoadParameters&, Residual& out) {
    friction_contacts_.clear();
    contacts_.select(contact_.evaluated_contacts(), contact_.factor(),
                     [&](const ActiveContact& active, bool lagged, double factor) {
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
                     });
}

void BodyFrictionTerm::set_frozen(bool frozen) {
    contacts_.set_frozen(frozen, contact_.evaluated_contacts());
    contact_.set_extra_couplings(frozen ? contacts_.frozen_contacts() : contacts_.at_begin());
}

void BodyFrictionTerm::assemble(const Kinematics& at, const LoadParameters&, bool positive_definite,
                                SystemMatrix&, NonsymmetricTangent& rest) const {
    for (const FrictionContact& each : friction_contacts_) {
        const std::array<Index, 4>& nodes = each.active->near.pair.nodes;
        contact_.layer().add(nodes, [&](int i, int j) -> Mat3 {
            return -at.rate * each.friction.by_velocity(i, j, positive_definite);
        });
        if (each.lagged || contacts_.frozen()) continue;
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
        contact_.add_vjp(
            active, active.at.vjp(no_motion, -of.by_normal_force),
            {-each.factor * of.by_law.kinetic, -each.factor * of.by_law.fixed, -of.by_law.sticking_speed},
            each.lagged ? 1.0 : contact_.factor(), out.values);
    }
}

// The force depends on the rest shape through the normal forces alone.
void BodyFrictionTerm::add_rest_vjp(const Kinematics&, const VectorXd& lambda, VectorXd& out) const {
    ContactRest by_rest = contact_.rest_gradient();
    for (const FrictionContact& each : friction_contacts_) {
        const ActiveContact& active = *each.active;
        const PairFriction::Gradient of = each.friction.vjp(positions_of(active.near.pair, lambda.data()));
        by_rest.add(active.near, active.at.pair_vjp(no_motion, -of.by_normal_force));
    }
    by_rest.add_to(out);
}

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
