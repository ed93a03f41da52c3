// The free-flight defect of rigid bodies that no joint holds.
//
// The stages of a step (tableau.h) treat the rotation of a body as a motion of its points under constraint forces, which they integrate
// with the error of the method. The part of this error that is due to the torque-free motion x^f from the state at the beginning of the
// step is known before the step (torque_free_rotation.h) and is removed from it:
//
//   x^_i += x^f_i - x_0 - dt sum_j a_ij v^f_j,      v^_i += v^f_i - v_0 - dt sum_j a_ij w^f_j
//
// A body on which no torque acts then moves exactly along x^f, with constant momentum and energy. At the end of the step its
// velocities become those of the rigid motion with the same momenta, and the acceleration with which the next step begins
// becomes w + w^f_0(next step) - w^f.
#pragma once

#include "magshell/solve/motion/free_body.h"
#include "magshell/solve/motion/tableau.h"
#include "magshell/solve/motion/torque_free_rotation.h"
#include "magshell/solve/motion/viscosity.h"

namespace magshell {

class FreeFlight {
  public:
    /// The motion of one body, with the matrices that its stages add, times rho: x^_i += position[i] rho, v^_i += velocity[i] rho.
    struct Flight {
        const FreeBody* body;
        RigidMotion begin;
        TorqueFreeRotation rotation;
        std::vector<Mat3> position, velocity;
    };

    /// q, v: the state at the beginning of a step of duration dt [s]. The bodies must outlive it.
    FreeFlight(const std::vector<FreeBody>& bodies, const Tableau& tableau, double dt, const VectorXd& q,
               const VectorXd& v);

    bool any() const { return !flights_.empty(); }
    const std::vector<Flight>& flights() const { return flights_; }
    const Tableau& tableau() const { return tableau_; }
    double dt() const { return dt_; }

    /// Adds the defect to the prediction of a stage.
    void add_defect(int stage, VectorXd& x_hat, VectorXd& v_hat) const;
    /// Adds a factor times the change of the velocity v^f from one state to the next one; the state at the beginning is 0, that of stage i
    /// is i + 1.
    void add_velocity_change(std::size_t from, double factor, VectorXd& rows) const;
    /// Subtracts the sum of weights times v^f, over the states, from the same sum of the velocities of a step. The weights add up to zero.
    void subtract_velocities(std::span<const double> weights, VectorXd& sum) const;
    /// Replaces the positions of its bodies in a prediction by those of the nearest rigid bodies.
    void make_rigid(const VectorXd& predicted, VectorXd& q) const;
    /// Replaces the velocities and accelerations at the end of the step, at q, by those with which the next one begins.
    void finish(const VectorXd& q, StageRates& last) const;

  private:
    Tableau tableau_;
    double dt_;
    std::vector<Flight> flights_;
};

}  // namespace magshell
