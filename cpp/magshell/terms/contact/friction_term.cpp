#include "magshell/terms/contact/friction_term.h"

namespace magshell {
namespace {

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

// Returns df/dx for a coefficient of one: the total dependence on the position through N, n and the obstacle's
// velocity.
Mat3 by_position(const Friction& friction, const ContactTerm::ActiveContact& active, const Vec3& spin) {
    return -active.stiffness * friction.by_normal_force * active.at.normal.transpose() +
           friction.by_normal * active.at.curvature - friction.by_velocity * cross_matrix(spin);
}

}  // namespace

void FrictionTerm::begin_step(const VectorXd& q, const LoadParameters& load_parameters) {
    load_parameters_before_ = load_parameters;
    contacts_.begin_step([&] { return contact_.active_contacts(q.data(), load_parameters); });
}

void FrictionTerm::evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) {
    friction_contacts_.clear();
    contacts_.select(contact_.evaluated_contacts(), contact_.factor(),
                     [&](const ContactTerm::ActiveContact& active, bool lagged, double factor) {
                         const ObstacleState obstacle = contact_.obstacle_state(
                             active.obstacle, lagged ? load_parameters_before_ : load_parameters);
                         const Vec3 velocity =
                             contact_.at_point(active, at.v.data()) - obstacle.velocity(active.position);
                         const ContactLaw& law = contact_.law(active);
                         friction_contacts_.push_back(
                             {&active, lagged, factor, obstacle,
                              Friction(active.force, active.at.normal, velocity, law.sticking_speed)});
                         contact_.distribute(
                             active, -factor * law.friction * friction_contacts_.back().friction.force, out);
                     });
}

void FrictionTerm::assemble(const Kinematics& at, const LoadParameters&, bool positive_definite,
                            SystemMatrix& out, NonsymmetricTangent& rest) const {
    for (const FrictionContact& each : friction_contacts_) {
        const ContactTerm::ActiveContact& active = *each.active;
        const double coefficient = each.factor * contact_.law(active).friction;
        const Mat3& by_velocity = positive_definite ? each.friction.secant : each.friction.by_velocity;
        contact_.add_block(active, -coefficient * at.rate * by_velocity, out);
        if (each.lagged || contacts_.frozen()) continue;
        const Mat3 block = -coefficient * by_position(each.friction, active, each.obstacle.spin());
        const ContactPoint& point = contact_.point(active);
        if (point.nodes[1] < 0) {
            rest.add(point.nodes[0], block);
            continue;
        }
        NonsymmetricTangent::FaceBlock shared{point.nodes, point.weights, {}};
        for (int k = 0; k < 3; ++k) shared.block.middleCols<3>(3 * k) = point.weights[k] * block;
        rest.add(shared);
    }
}

void FrictionTerm::vjp(const Kinematics&, const LoadParameters&, const VectorXd& lambda,
                       KinematicsGradient& by, Gradient& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const ContactTerm::ActiveContact& active = *each.active;
        const Friction& friction = each.friction;
        const double coefficient = each.factor * contact_.law(active).friction;
        const Vec3 along = contact_.at_point(active, lambda.data());
        const Vec3 by_velocity = coefficient * (friction.by_velocity * along);
        contact_.distribute(active, by_velocity, by.velocity);
        if (each.lagged) {
            const Mat3 by_begin = coefficient * by_position(friction, active, each.obstacle.spin());
            contact_.distribute(active, by_begin.transpose() * along, by.begin);
        }
        const double by_force = -coefficient * along.dot(friction.by_normal_force);
        ObstacleGradient by_obstacle;
        each.obstacle.vjp(active.position, active.at, -active.stiffness * by_force,
                          -coefficient * (friction.by_normal.transpose() * along), -by_velocity, by_obstacle);
        contact_.add_vjp(active, by_force,
                         {.friction = -each.factor * along.dot(friction.force),
                          .sticking_speed = -coefficient * along.dot(friction.by_sticking_speed)},
                         by_obstacle, out.values,
                         each.lagged ? by.begin_load_parameters : out.load_parameters);
    }
}

void FrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const double stiffness = at.rate * each.friction.by_velocity.norm();
        contact_.add_cancelling_force(*each.active,
                                      each.factor * contact_.law(*each.active).friction * stiffness, out);
    }
}

}  // namespace magshell
