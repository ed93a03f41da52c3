// The adjoint of the free-flight defect of one step (solve/motion/free_flight.h).
//
// The defects of the stages and the accelerations at the end are matrices times rho, so that the gradients with respect to them are sums
// over the nodes of a body. The gradients with respect to the matrices go back through the torque-free motion to the state at the beginning
// of the step, to the masses and to the duration of the step.
#pragma once

#include "magshell/solve/motion/free_flight.h"

namespace magshell {

class FreeFlightAdjoint {
  public:
    explicit FreeFlightAdjoint(const FreeFlight& flight);

    /// Goes back through FreeFlight::finish, for positions and velocities before it. by_w: gradient with respect to the accelerations,
    /// which stays. by_v: gradient with respect to the velocities, changed to that by those before it. Adds to by_q and by_masses.
    void through_finish(const VectorXd& q, const VectorXd& v, const VectorXd& by_w, VectorXd& by_v,
                        VectorXd& by_q, VectorXd& by_masses);
    /// Adds the gradient with respect to the prediction of a stage.
    void add_stage(int stage, const VectorXd& by_x_hat, const VectorXd& by_v_hat);
    /// Adds the gradients with respect to the state at the beginning, the masses and the duration of the step, and to rest positions unless
    /// by_rest is nullptr.
    void add_by_begin(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                      VectorXd& by_masses, double& by_dt, VectorXd* by_rest) const;

  private:
    struct Of {  // one body
        std::vector<TorqueFreeRotation::StateGradient> states;
        RigidMotion begin;  // gradients with respect to it
        ArmsGradient arms;
        TorqueFreeRotation::Gradients rotation;
        double dt = 0.0;
    };

    const FreeFlight& flight_;
    std::vector<Of> by_;
};

}  // namespace magshell
