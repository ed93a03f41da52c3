#include "magshell/adjoint/free_flight_adjoint.h"

namespace magshell {

FreeFlightAdjoint::FreeFlightAdjoint(const FreeFlight& flight)
    : flight_(flight), by_(flight.flights().size()) {
    for (std::size_t k = 0; k < by_.size(); ++k) by_[k].states.resize(flight.flights()[k].rotation.size());
}

void FreeFlightAdjoint::through_finish(const VectorXd& q, const VectorXd& v, const VectorXd& by_w,
                                       VectorXd& by_v, VectorXd& by_q, VectorXd& by_masses) {
    for (std::size_t k = 0; k < by_.size(); ++k) {
        const FreeFlight::Flight& flight = flight_.flights()[k];
        const FreeBody& body = *flight.body;
        Of& by = by_[k];
        const RigidMotion end = body.motion(q, v);
        // FreeFlight::finish: velocities become those of the rigid motion `end` with the same momenta, accelerations become
        // w + w^f(end) - w^f(last), with the torque-free accelerations w^f. `now`: the torque-free state that begins at `end`.
        const Mat3& inverse = body.inverse_inertia();
        const TorqueFreeRotation::State now = TorqueFreeRotation::State::of(inverse, end.turn, end.momentum);
        TorqueFreeRotation::StateGradient by_now;
        RigidMotion by_end;
        by_now.velocities = body.add_vjp(now.velocities(), by_v, by.arms);
        for (const Index node : body.nodes()) {
            by_end.velocity += by_v.segment<3>(3 * node);
            by_v.segment<3>(3 * node).setZero();
        }
        const std::size_t last = flight.rotation.size() - 1;
        const Mat3 of_flight = flight.rotation.at(last).accelerations();
        by_now.accelerations =
            body.add_vjp(now.accelerations() - flight.begin.turn * of_flight, by_w, by.arms);
        by.states[last].accelerations -= flight.begin.turn.transpose() * by_now.accelerations;
        by.begin.turn -= by_now.accelerations * of_flight.transpose();
        by_end.turn = by.rotation.add_state(inverse, now, by_now, by_end.momentum);
        body.motion_vjp(end, q, v, by_end, by_q, by_v, by_masses);
    }
}

void FreeFlightAdjoint::add_stage(int stage, const VectorXd& by_x_hat, const VectorXd& by_v_hat) {
    const Tableau& tableau = flight_.tableau();
    const int shift = tableau.begins_explicitly ? 0 : 1;
    for (std::size_t k = 0; k < by_.size(); ++k) {
        const FreeFlight::Flight& flight = flight_.flights()[k];
        Of& by = by_[k];
        const Mat3 to_body = flight.begin.turn.transpose(),
                   by_position = to_body * flight.body->add_vjp(flight.position[stage], by_x_hat, by.arms),
                   by_velocity = to_body * flight.body->add_vjp(flight.velocity[stage], by_v_hat, by.arms);
        // position = R p and velocity = R v, with p and v in the axes of the body.
        by.begin.turn += flight.begin.turn * (by_position * (to_body * flight.position[stage]).transpose() +
                                              by_velocity * (to_body * flight.velocity[stage]).transpose());
        by.states[stage + 1].turn += by_position;
        by.states[0].turn -= by_position;
        by.states[stage + 1].velocities += by_velocity;
        by.states[0].velocities -= by_velocity;
        for (int j = 0; j + shift <= stage + 1; ++j) {
            const double a = tableau.a[stage][j];
            const TorqueFreeRotation::State& at = flight.rotation.at(j + shift);
            by.states[j + shift].velocities -= flight_.dt() * a * by_position;
            by.states[j + shift].accelerations -= flight_.dt() * a * by_velocity;
            by.dt -= a * (by_position.cwiseProduct(at.velocities()).sum() +
                          by_velocity.cwiseProduct(at.accelerations()).sum());
        }
    }
}

void FreeFlightAdjoint::add_by_begin(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                                     VectorXd& by_masses, double& by_dt, VectorXd* by_rest) const {
    for (std::size_t k = 0; k < by_.size(); ++k) {
        const FreeFlight::Flight& flight = flight_.flights()[k];
        Of by = by_[k];
        flight.rotation.vjp(by.states, by.rotation);
        by.begin.momentum += by.rotation.momentum;
        flight.body->motion_vjp(flight.begin, q, v, by.begin, by_q, by_v, by_masses);
        flight.body->inertia_vjp(by.rotation.inverse_inertia, by.arms.together, by_masses);
        if (by_rest) flight.body->rest_vjp(by.rotation.inverse_inertia, by.arms, *by_rest);
        by_dt += by.dt + by.rotation.dt;
    }
}

}  // namespace magshell
