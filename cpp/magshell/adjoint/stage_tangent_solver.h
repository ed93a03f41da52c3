// The linear equations of the tangent of one stage (motion_tangent.h): their residual by inertia, their solution, and the acceleration by
// contact that follows from it.
#pragma once

#include "magshell/adjoint/motion_derivatives.h"

namespace magshell {

class StageTangentSolver {
  public:
    StageTangentSolver(Newton& newton, const MotionInput& input, const MotionInputTangent& along,
                       MotionDerivatives& derivatives)
        : newton_(newton), model_(newton.model()), input_(input), along_(along), derivatives_(derivatives) {}

    /// Begins a substep, whose stages share no factorization with those before.
    void begin_substep() { factorized_here_ = false; }
    /// Returns (H + W) times a change of the state evaluated last.
    VectorXd product(const VectorXd& change, const VectorXd& weights) const;
    /// Returns the derivative of the inertial and damping forces M w + Gamma v at a fixed state q, with v = (q - x^)/T, w = (v - v^)/T and
    /// the time T = a dt of the stage.
    VectorXd inertia(const StageTangent& stage, const VectorXd& v, const VectorXd& w) const;
    /// Returns a factorization that was made near stage i: that of its last Newton iteration, or that of the stage before, whose inertia is
    /// the same and whose stiffness is nearly so without contact; nullptr if there is none.
    const Factor* nearby_factor(const SubstepRecord& record, int i, const LoadParameters& load_parameters);
    /// Returns the change of the state that cancels a change of the residual of a stage, given the change of the prescribed motion. The
    /// model must have been evaluated last at q. nearby: a factorization made near q, or nullptr.
    VectorXd solve(const VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                   const PrescribedTangent& change, VectorXd residual, const Factor* nearby);
    /// Returns the derivative of the acceleration by contact, c = J (J^T M J)^-1 J^T f, of a stage that moves by q_tangent.
    VectorXd contact_acceleration(const StageTangent& stage, const VectorXd& q, const VectorXd& q_tangent,
                                  const VectorXd& by_inputs, const VectorXd& c);

  private:
    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionInputTangent& along_;
    MotionDerivatives& derivatives_;
    DirectionalDerivative rotation_derivative_;
    bool factorized_here_ = false;  // whether the factorization of newton_ is of this substep
};

}  // namespace magshell
