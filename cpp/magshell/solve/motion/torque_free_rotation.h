// The rotation of a rigid body on which no torque acts, in axes fixed to the body.
//
//   Pi' = Pi x Omega,   Omega = K Pi,   T' = T [Omega]          Pi: angular momentum, K: inverse of the inertia, T: rotation
//
// A midpoint step of duration h conserves the momentum in space T Pi and the energy Pi . K Pi / 2:
//
//   u = Pi + h/2 u x K u,   f = h K u,   T <- T cay(f),   Pi <- cay(f)^T Pi,   cay(f) = (I - [f]/2)^-1 (I + [f]/2)
//
// Steps of the durations p, p, 1 - 4 p, p, p, with p = 1/(4 - 4^(1/3)), are together of fourth order [Suzuki 1990].
#pragma once

#include <span>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Returns [a] with [a] b = a x b.
Mat3 cross_product_matrix(const Vec3& a);
/// Returns the vector c with c . a = <m, [a]>, the sum over all entries, for any a.
Vec3 cross_product_vjp(const Mat3& m);

class TorqueFreeRotation {
  public:
    /// The motion at one time. A point at rho from the center of mass has the position T rho, and the velocity and acceleration below.
    struct State {
        Mat3 turn = Mat3::Identity();       // T
        Vec3 momentum, rate, acceleration;  // Pi, Omega, K (Pi x Omega)
        Mat3 velocities() const;            // T [Omega]
        Mat3 accelerations() const;         // T ([K (Pi x Omega)] + [Omega]^2)
        /// Returns the state with this rotation and momentum.
        static State of(const Mat3& inverse_inertia, const Mat3& turn, const Vec3& momentum);
    };
    /// Gradients with respect to the three matrices of a state.
    struct StateGradient {
        Mat3 turn = Mat3::Zero(), velocities = Mat3::Zero(), accelerations = Mat3::Zero();
    };
    /// Gradients with respect to the arguments of the constructor.
    struct Gradients {
        Vec3 momentum = Vec3::Zero();
        Mat3 inverse_inertia = Mat3::Zero();
        double dt = 0.0;

        /// Goes back through State::of, for a state with this gradient. Returns the gradient with respect to its turn.
        Mat3 add_state(const Mat3& inverse_inertia, const State& state, const StateGradient& by,
                       Vec3& by_momentum);
    };

    /// Returns true if the motion over dt [s] is resolved: the body turns by a few times at most.
    static bool resolves(const Mat3& inverse_inertia, const Vec3& momentum, double dt);

    /// times: ascending, of the states, over dt [s]; the first is zero.
    TorqueFreeRotation(const Mat3& inverse_inertia, const Vec3& momentum, double dt,
                       std::span<const double> times);

    const State& at(std::size_t k) const { return states_[k]; }
    std::size_t size() const { return states_.size(); }
    const Mat3& inverse_inertia() const { return inverse_inertia_; }
    /// Adds the gradients with respect to the arguments, given one by each state.
    void vjp(std::span<const StateGradient> by, Gradients& out) const;

  private:
    struct Step {
        double fraction;  // of dt
        Vec3 mean;        // u
        Mat3 turn;        // cay(f)
        State begin;
    };
    void step(double fraction, State& state);

    Mat3 inverse_inertia_;
    double dt_;
    std::vector<State> states_;
    std::vector<Step> steps_;
    std::vector<std::size_t> steps_before_;  // of each state
};

}  // namespace magshell
