// The tangent of the motor forces at the end of a substep (solve/motion/motor_reactions.h, motion_tangent.h).
#pragma once

#include "magshell/adjoint/stage_tangent_solver.h"
#include "magshell/adjoint/viscous_tangent.h"

namespace magshell {

class MotorForceTangent {
  public:
    MotorForceTangent(Newton& newton, const MotionInput& input, const MotionInputTangent& along,
                      MotionDerivatives& derivatives, StageTangentSolver& solver)
        : newton_(newton),
          model_(newton.model()),
          input_(input),
          along_(along),
          derivatives_(derivatives),
          solver_(solver) {}

    /// Returns the tangent of the motor forces. last, q_last, there, rates_tangent: the last stage, its state, its inertial term and the
    /// tangent of its rates. v_begin_tangent: that of the velocities with which the substep began. Leaves the model linearized at the state
    /// of the motor forces.
    VectorXd at_end(const StepAlgebra& algebra, const StepRates& at, const StageTangent& last,
                    const VectorXd& q_last, const ProximalTerm& there, const VectorXd& v_begin_tangent,
                    const StageRates& rates_tangent, double dt_tangent, const ViscousTangent& strains,
                    const ViscousTangent& joints);
    /// Takes note of a substep that is done, as the forces at the end of the next one depend on it.
    void end_substep(const VectorXd& v_begin_tangent, double dt_tangent) {
        v_before_ = v_begin_tangent;
        dt_before_tangent_ = dt_tangent;
    }

  private:
    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionInputTangent& along_;
    MotionDerivatives& derivatives_;
    StageTangentSolver& solver_;
    DirectionalDerivative derivative_;
    VectorXd v_before_;  // tangent of MotionState::v_before
    double dt_before_tangent_ = 0.0;
};

}  // namespace magshell
