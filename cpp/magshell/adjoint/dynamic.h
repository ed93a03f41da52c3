// The adjoint of a motion, backwards through its stages. In the notation of solve/motion/stepper.h, with primes for gradients of the loss:
//
//   v_i = (x_i - x^_i)/(a dt),  w_i = (v_i - v^_i)/(a dt):
//       v'_i += w'_i/(a dt),  v^'_i -= w'_i/(a dt)   (with implicit contact w_i = e_i + F c_i, so that c'_i -= F e'_i),
//       x'_i += v'_i/(a dt),  x^'_i -= v'_i/(a dt)
//   (W + H) lambda_i = - x'_i:
//       x^'_i -= W lambda_i,  v^'_i -= M/(a dt) lambda_i,  k' += lambda_i . dg/dk
//   r_i = (p_i - p^_i)/(a dt) of carried momentum likewise: p'_i = (r'_i + lambda_i)/(a dt), p^'_i = - p'_i, and p^_i = p + dt sum a_ij r_j
//   (with viscosity, the strains d and e are treated likewise, see solve/motion/viscosity.h)
//   x^_i = x + dt sum a_ij v_j,  v^_i = v + dt sum a_ij w_j:
//       x' += x^'_i,  v' += v^'_i,  v'_j += dt a_ij x^'_i,  w'_j += dt a_ij v^'_i
//
// For implicit Euler this is [Chen22] (40) with its two equations combined.
#pragma once

#include "magshell/adjoint/rest_gradient.h"
#include "magshell/solve/motion/dynamics.h"

namespace magshell {

/// The adjoint of a stage and its motion, of all dofs: forces f on the residual of the stage would change the loss by lambda . f.
struct StageAdjoint {
    VectorXd lambda, q, velocity, acceleration;
    LoadParameters load_parameters;
};

/// The gradient of a loss by all inputs of a motion.
struct MotionGradient {
    VectorXd positions, velocities;  // at the start, of all dofs
    VectorXd mass, damping;          // of all dofs
    std::vector<double> time_steps;  // one number a step
    Viscosity viscosity;
    VectorXd values;                              // of the scene
    RestGradient rest;                            // if asked for
    std::vector<LoadParameters> load_parameters;  // as MotionInput::load_parameters
    std::vector<StageAdjoint> stages;             // if asked for, the first one first
    int factorizations = 0;                       // that the adjoint took, including those of repeated steps
};

/// The gradient of a loss by the recorded states of a motion.
struct GradientsByStates {
    std::vector<VectorXd> q, v;  // by the dofs and by the velocities
    std::vector<VectorXd>
        motor_forces;  // by the motor forces, in the order of DofMap::motor_forces; empty if the loss does not depend on them
    bool wants_rest = false;    // whether the gradient with respect to rest positions is asked for
    bool wants_stages = false;  // whether the adjoints of all stages are
};

/// Returns the gradients with respect to all inputs from those with respect to the recorded states. Throws InvalidInput if the motion was
/// not stored for its adjoint.
MotionGradient motion_vjp(Model& model, const MotionInput& input, const MotionResult& motion,
                          const GradientsByStates& by, const MotionWatch& watch = {});

}  // namespace magshell
