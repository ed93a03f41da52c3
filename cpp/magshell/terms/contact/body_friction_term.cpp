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
                              PairFriction(active.at, active.slip, active.slip.of(at.v.data()), law)});
                         const SlipVectors force = friction_contacts_.back().friction.force();
                         for (int k = 0; k < active.slip.count; ++k)
                             for (int axis = 0; axis < 3; ++axis)
                                 out.add(3 * active.slip.nodes[k] + axis, -force[k][axis]);
                     });
}

void BodyFrictionTerm::set_frozen(bool frozen) {
    contacts_.set_frozen(frozen, contact_.evaluated_contacts());
    contact_.set_extra_couplings(frozen ? contacts_.frozen_contacts() : contacts_.at_begin());
}

void BodyFrictionTerm::assemble(const Kinematics& at, const LoadParameters&, bool positive_definite,
                                SystemMatrix&, NonsymmetricTangent& rest) const {
    for (const FrictionContact& each : friction_contacts_) {
        const std::array<Index, slip_nodes>& nodes = each.active->slip.nodes;
        contact_.layer().add(nodes, [&](int i, int j) -> Mat3 {
            return -at.rate * each.friction.by_velocity(i, j, positive_definite);
        });
        if (each.lagged || contacts_.frozen()) continue;
        PairFriction::Blocks blocks;
        each.friction.by_position(blocks);
        const auto add = [&](const std::array<int, 4>& places, const auto& wanted) {
            NonsymmetricTangent::PairBlock& pair = rest.append_pair();
            for (int i = 0; i < 4; ++i) {
                pair.nodes[i] = places[i] < 0 ? -1 : nodes[places[i]];
                for (int j = 0; j < 4; ++j) {
                    Mat3& block = pair.blocks[4 * i + j];
                    block.setZero();
                    if (places[i] >= 0 && places[j] >= 0 && wanted(places[i], places[j]))
                        block = -blocks[slip_nodes * places[i] + places[j]];
                }
            }
        };
        add({0, 1, 2, 3}, [](int, int) { return true; });
        if (nodes[4] < 0) continue;
        const auto with_last = [](int i, int j) { return i == 4 || j == 4; };
        add({4, 0, 1, 2}, with_last);
        add({4, 3, -1, -1}, [&](int i, int j) { return with_last(i, j) && i != j; });
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
        const PairFriction::Gradient of = each.friction.vjp(active.slip.of(lambda.data()));
        for (int k = 0; k < active.slip.count; ++k) {
            const Index first = 3 * active.slip.nodes[k];
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
        const PairFriction::Gradient of = each.friction.vjp(active.slip.of(lambda.data()));
        by_rest.add(active.near, active.at.pair_vjp(no_motion, -of.by_normal_force));
    }
    by_rest.add_to(out);
}

void BodyFrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const double stiffness = at.rate * each.friction.friction().by_velocity.norm() * each.active->far;
        for (int k = 0; k < each.friction.count(); ++k)
            out.segment<3>(3 * each.active->slip.nodes[k]).array() += each.friction.map(k).norm() * stiffness;
    }
}

}  // namespace magshell
