// The adjoint of a motion, backwards through its stages. With the notation of solve/stepper.h and bars for gradients,
//
//   v_i = (x_i - x^_i)/(a dt),  w_i = (v_i - v^_i)/(a dt):
//       v'_i += w'_i/(a dt),  v^'_i -= w'_i/(a dt),  x'_i += v'_i/(a dt),  x^'_i -= v'_i/(a dt)
//   (W + H) lambda_i = - x'_i:
//       x^'_i -= W lambda_i,  v^'_i -= M/(a dt) lambda_i,  k' += lambda_i . dg/dk
//   (with a viscous sheet, the strains d and e go back along with them: solve/viscosity.h)
//   x^_i = x + dt sum a_ij v_j,  v^_i = v + dt sum a_ij w_j:
//       x' += x^'_i,  v' += v^'_i,  v'_j += dt a_ij x^'_i,  w'_j += dt a_ij v^'_i
//
// For implicit Euler this is [Chen22] (40) with its two equations made one.
#pragma once

#include "magshell/solve/dynamics.h"

namespace magshell {

/// Shaped like what a motion was computed from.
struct MotionGradient {
    VectorXd positions, velocities;  // at the start; of all unknowns
    VectorXd mass, damping;          // of all unknowns
    double time_step = 0.0;
    Viscosity viscosity{0.0, 0.0, 0.0};
    VectorXd values;                 // of the scene
    std::vector<Controls> controls;  // as MotionInput::controls
    int factorizations = 0;          // that it took, those of steps taken again included
};

/// By the recorded states of a motion.
struct GradientsByStates {
    std::vector<VectorXd> q, v;     // their unknowns and velocities
    std::vector<VectorXd> driving;  // what motors do, as Reduction::driving has it; empty where nothing asks
};

/// By everything, from the gradients by the recorded states. Throws InvalidInput where the motion was not kept for
/// gradients.
MotionGradient pull_back(Model& model, const MotionInput& input, const MotionResult& motion,
                         const GradientsByStates& by, const MotionWatch& watch = {});

}  // namespace magshell
