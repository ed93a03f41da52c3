#include "magshell/solve/motion/free_flight.h"

namespace magshell {

FreeFlight::FreeFlight(const std::vector<FreeBody>& bodies, const Tableau& tableau, double dt,
                       const VectorXd& q, const VectorXd& v)
    : tableau_(tableau), dt_(dt) {
    if (bodies.empty()) return;
    std::vector<double> times = {0.0};
    for (int i = 0; i < tableau.stages; ++i) times.push_back(tableau.time(i));
    const int shift = tableau.begins_explicitly ? 0 : 1;
    for (const FreeBody& body : bodies) {
        const RigidMotion begin = body.motion(q, v);
        const Mat3& k = body.inverse_inertia();
        if (!TorqueFreeRotation::resolves(k, begin.momentum, dt)) continue;
        Flight& flight = flights_.emplace_back(
            Flight{&body, begin, TorqueFreeRotation(k, begin.momentum, dt, times), {}, {}});
        std::vector<Mat3> turns, velocities, accelerations;
        for (std::size_t n = 0; n < times.size(); ++n) {
            const TorqueFreeRotation::State& at = flight.rotation.at(n);
            turns.push_back(begin.turn * at.turn);
            velocities.push_back(begin.turn * at.velocities());
            accelerations.push_back(begin.turn * at.accelerations());
        }
        for (int i = 0; i < tableau.stages; ++i) {
            Mat3 position = turns[i + 1] - turns[0], velocity = velocities[i + 1] - velocities[0];
            for (int j = 0; j + shift <= i + 1; ++j) {
                position -= dt * tableau.a[i][j] * velocities[j + shift];
                velocity -= dt * tableau.a[i][j] * accelerations[j + shift];
            }
            flight.position.push_back(position);
            flight.velocity.push_back(velocity);
        }
    }
}

void FreeFlight::add_defect(int stage, VectorXd& x_hat, VectorXd& v_hat) const {
    for (const Flight& flight : flights_) {
        flight.body->add(flight.position[stage], x_hat);
        flight.body->add(flight.velocity[stage], v_hat);
    }
}

void FreeFlight::add_velocity_change(std::size_t from, double factor, VectorXd& rows) const {
    for (const Flight& flight : flights_)
        flight.body->add(
            factor * flight.begin.turn *
                (flight.rotation.at(from + 1).velocities() - flight.rotation.at(from).velocities()),
            rows);
}

void FreeFlight::subtract_velocities(std::span<const double> weights, VectorXd& sum) const {
    for (const Flight& flight : flights_) {
        Mat3 velocities = Mat3::Zero();
        for (std::size_t n = 0; n < weights.size(); ++n)
            velocities -= weights[n] * flight.rotation.at(n).velocities();
        flight.body->add(flight.begin.turn * velocities, sum);
    }
}

void FreeFlight::make_rigid(const VectorXd& predicted, VectorXd& q) const {
    for (const Flight& flight : flights_) flight.body->make_rigid(predicted, q);
}

void FreeFlight::finish(const VectorXd& q, StageRates& last) const {
    for (const Flight& flight : flights_) {
        const FreeBody& body = *flight.body;
        const RigidMotion end = body.motion(q, last.v);
        const TorqueFreeRotation::State now =
            TorqueFreeRotation::State::of(body.inverse_inertia(), end.turn, end.momentum);
        body.add(now.accelerations() -
                     flight.begin.turn * flight.rotation.at(flight.rotation.size() - 1).accelerations(),
                 last.acceleration);
        for (const Index node : body.nodes()) last.v.segment<3>(3 * node) = end.velocity;
        body.add(now.velocities(), last.v);
    }
}

}  // namespace magshell
