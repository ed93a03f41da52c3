#include "magshell/solve/motion/torque_free_rotation.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace magshell {
namespace {

// [-] Durations of the steps of a composition; see test_free_rotation_is_of_fourth_order.
constexpr double outer_step = 0.41449077179437573714;
constexpr std::array<double, 5> composition = {outer_step, outer_step, 1.0 - 4.0 * outer_step, outer_step,
                                               outer_step};
// [rad] Largest angle of a composition, whose error is then below 1e-4 rad; see test_free_rotation_is_of_fourth_order.
constexpr double largest_angle = 1.0;
// [rad] Largest angle of a step; see test_body_that_turns_many_times_a_step_has_no_flight.
constexpr double most_turned = 50.0;
// Newton iterations for u at most; see test_free_rotation_conserves_momentum_and_energy.
constexpr int most_iterations = 20;
// [-] Change of u, over the momentum, at which they end; see test_free_rotation_conserves_momentum_and_energy.
constexpr double midpoint_tolerance = 1e-15;

double largest_turn(const Mat3& inverse_inertia, const Vec3& momentum, double dt) {
    return dt * inverse_inertia.norm() * momentum.norm();
}

Mat3 half_turn(const Vec3& f) {
    return Mat3::Identity() - 0.5 * cross_product_matrix(f);
}

// Returns the derivative of u - h/2 u x K u by u.
Mat3 midpoint_jacobian(const Mat3& k, const Vec3& u, double h) {
    return Mat3::Identity() - 0.5 * h * (cross_product_matrix(u) * k - cross_product_matrix(k * u));
}

Vec3 midpoint(const Mat3& k, const Vec3& momentum, double h) {
    Vec3 u = momentum;
    for (int round = 0; round < most_iterations; ++round) {
        const Vec3 off = u - momentum - 0.5 * h * u.cross(k * u);
        const Vec3 change = midpoint_jacobian(k, u, h).inverse() * off;
        u -= change;
        if (!(change.norm() > midpoint_tolerance * momentum.norm())) break;
    }
    return u;
}

}  // namespace

Mat3 cross_product_matrix(const Vec3& a) {
    Mat3 m;
    m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
    return m;
}

Vec3 cross_product_vjp(const Mat3& m) {
    return {m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)};
}

Mat3 TorqueFreeRotation::State::velocities() const {
    return turn * cross_product_matrix(rate);
}

Mat3 TorqueFreeRotation::State::accelerations() const {
    const Mat3 spin = cross_product_matrix(rate);
    return turn * (cross_product_matrix(acceleration) + spin * spin);
}

TorqueFreeRotation::State TorqueFreeRotation::State::of(const Mat3& inverse_inertia, const Mat3& turn,
                                                        const Vec3& momentum) {
    const Vec3 rate = inverse_inertia * momentum;
    return {turn, momentum, rate, inverse_inertia * momentum.cross(rate)};
}

Mat3 TorqueFreeRotation::Gradients::add_state(const Mat3& k, const State& state, const StateGradient& by,
                                              Vec3& by_momentum) {
    const Mat3 spin = cross_product_matrix(state.rate), by_second = state.turn.transpose() * by.accelerations;
    const Vec3 by_acceleration = cross_product_vjp(by_second);
    Vec3 by_rate = cross_product_vjp(state.turn.transpose() * by.velocities + by_second * spin.transpose() +
                                     spin.transpose() * by_second);
    const Vec3 through = k * by_acceleration;
    inverse_inertia += by_acceleration * state.momentum.cross(state.rate).transpose();
    by_rate += through.cross(state.momentum);
    by_momentum += state.rate.cross(through) + k * by_rate;
    inverse_inertia += by_rate * state.momentum.transpose();
    return by.turn + by.velocities * spin.transpose() +
           by.accelerations * (cross_product_matrix(state.acceleration) + spin * spin).transpose();
}

bool TorqueFreeRotation::resolves(const Mat3& inverse_inertia, const Vec3& momentum, double dt) {
    return largest_turn(inverse_inertia, momentum, dt) <= most_turned;
}

TorqueFreeRotation::TorqueFreeRotation(const Mat3& inverse_inertia, const Vec3& momentum, double dt,
                                       std::span<const double> times)
    : inverse_inertia_(inverse_inertia), dt_(dt) {
    const double turned = largest_turn(inverse_inertia, momentum, dt);
    State state = State::of(inverse_inertia, Mat3::Identity(), momentum);
    states_.push_back(state);
    steps_before_.push_back(0);
    for (std::size_t k = 1; k < times.size(); ++k) {
        const double span = times[k] - times[k - 1];
        const int parts = 1 + static_cast<int>(turned * span / largest_angle);
        for (int part = 0; part < parts; ++part)
            for (const double each : composition) step(each * span / parts, state);
        states_.push_back(state);
        steps_before_.push_back(steps_.size());
    }
}

void TorqueFreeRotation::step(double fraction, State& state) {
    const double h = fraction * dt_;
    const Vec3 u = midpoint(inverse_inertia_, state.momentum, h), f = h * (inverse_inertia_ * u);
    const Mat3 turn = half_turn(f).inverse() * half_turn(-f);
    steps_.push_back({fraction, u, turn, state});
    state = State::of(inverse_inertia_, state.turn * turn, turn.transpose() * state.momentum);
}

void TorqueFreeRotation::vjp(std::span<const StateGradient> by, Gradients& out) const {
    const Mat3& k = inverse_inertia_;
    Mat3 by_turn = Mat3::Zero();
    Vec3 by_momentum = Vec3::Zero();
    std::size_t done = steps_.size();
    for (std::size_t n = states_.size(); n-- > 0;) {
        for (; done > steps_before_[n]; --done) {
            const Step& step = steps_[done - 1];
            const double h = step.fraction * dt_;
            const Vec3 f = h * (k * step.mean);
            const Mat3 by_step =
                step.begin.turn.transpose() * by_turn + step.begin.momentum * by_momentum.transpose();
            by_turn = by_turn * step.turn.transpose();
            by_momentum = step.turn * by_momentum;
            const Vec3 by_f = 0.5 * cross_product_vjp(half_turn(f).inverse().transpose() * by_step *
                                                      (Mat3::Identity() + step.turn).transpose());
            const Vec3 by_mean = h * (k * by_f);
            const Vec3 lambda = midpoint_jacobian(k, step.mean, h).transpose().inverse() * by_mean;
            const Vec3 rate = k * step.mean;
            by_momentum += lambda;
            out.inverse_inertia +=
                h * by_f * step.mean.transpose() + 0.5 * h * lambda.cross(step.mean) * step.mean.transpose();
            out.dt += step.fraction * (by_f.dot(rate) + 0.5 * lambda.dot(step.mean.cross(rate)));
        }
        by_turn += out.add_state(k, states_[n], by[n], by_momentum);
    }
    out.momentum += by_momentum;
}

}  // namespace magshell
