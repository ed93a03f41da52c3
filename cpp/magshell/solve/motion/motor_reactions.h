// Constraint forces of joint motors at the end of a time step, to second order.
//
// The acceleration w of the last stage is first-order accurate along a prescribed motion. An acceleration w_e that is second-order accurate
// follows from the velocities at the ends of three steps. Stiff terms have been solved for with w, so they are first-order
// accurate as well; the state is therefore solved for once more with the inertial force M (w_e - w) added, and the motor forces are
// taken there. In a first step there are only two velocities, and the forces of the last stage are returned. Where contact is implicit, w
// has more than the acceleration by contact at the end (tableau.h); neither w_e nor the forces in a first step have it.
#pragma once

#include "magshell/solve/motion/stepper.h"

namespace magshell {

/// The state next to the end of a step, just solved for, at which the motor forces are evaluated.
class MotorReactions {
  public:
    /// q, proximal, v_hat, last: state, inertia, start and rates of the last stage. Leaves the model evaluated at q(), with the
    /// angle branches that it had and contact forces without the factor of the stage.
    MotorReactions(Newton& newton, const Inertia& inertia, const MotionState& begin, const StepAlgebra& step,
                   const VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                   const VectorXd& v_hat, const StageRates& last);

    const VectorXd& q() const { return q_; }
    /// Returns the inertial term of this state; it refers to this object.
    ProximalTerm proximal() const { return {proximal_.weights, &target_, proximal_.motion}; }
    /// Returns true if the state was found.
    bool converged() const { return converged_; }
    /// Returns w_e - w: w_e = weight_last v_last + weight_begin v_begin + weight_before v_before [1/s]. In a first step there are no
    /// weights, and it is what implicit contact adds to w without acting at the end: contact_weight() times the acceleration by contact.
    /// Empty if nothing is added.
    const VectorXd& acceleration_change() const { return change_; }
    /// Returns the derivative of w_e by the length of the step before; empty in a first step.
    const VectorXd& change_by_dt_before() const { return by_dt_before_; }
    bool is_first_step() const { return weight_last_ == 0.0; }
    double contact_weight() const { return contact_weight_; }
    double weight_last() const { return weight_last_; }
    double weight_begin() const { return weight_begin_; }
    double weight_before() const { return weight_before_; }
    /// Returns the forces [N] and moments [N m] of the motors; NaN if the state was not found.
    VectorXd motor_forces(const LoadParameters& load_parameters);

  private:
    bool solve(const LoadParameters& load_parameters);

    Newton& newton_;
    ProximalTerm proximal_;
    VectorXd q_, target_, change_, by_dt_before_;
    double weight_last_ = 0.0, weight_begin_ = 0.0, weight_before_ = 0.0, contact_weight_ = 0.0;
    bool converged_ = true;
};

}  // namespace magshell
