// The tangent of a motion: the derivative of its states along one direction of its inputs, forwards through its stages. In the notation of
// solve/motion/stepper.h, with d for derivatives along the direction:
//
//   dx^_i = dx + d(dt sum a_ij v_j),  dv^_i = dv + d(dt sum a_ij w_j)
//   (W + H) dx_i = - (r + (H + W) dx_h)
//       r: change of the residual of the stage at the fixed x_i, by x^_i, v^_i, masses, forces and strain history
//       dx_h: the change of x that supports and motors prescribe
//   dv_i = d((x_i - x^_i)/(a dt)),  dw_i = d((v_i - v^_i)/(a dt)),  and dr_i = d((p_i - p^_i)/(a dt)) of carried momentum
//
// The derivative of the forces with respect to the inputs is a central difference along the direction (directional_derivative.h), whose cost
// does not depend on the number of inputs; inertia and strain history are differentiated exactly. A stage is solved with the factorization
// of its last Newton iteration if that is at hand, else with a new one; later stages of a step with that of an earlier one.
#pragma once

#include "magshell/solve/motion/dynamics.h"

namespace magshell {

/// Holds the derivatives of all inputs of a motion along one direction.
struct MotionInputTangent {
    VectorXd values;  // of the scene, in the order of the caller
    /// Returns all values at x + t direction for a number t, if they do not change linearly with t; throws InvalidInput beyond their range.
    std::function<VectorXd(double)> values_at;
    /// Returns the model of the scene at x + t direction, with its values there, if the rest shape changes. Its numbering is the same, and it
    /// lives as long as the direction is used. Throws InvalidInput beyond the range.
    std::function<Model&(double)> model_at;
    std::vector<LoadParameters> load_parameters;  // as MotionInput::load_parameters
    VectorXd positions, velocities;               // at the start, of all dofs
    VectorXd mass, damping;                       // of all dofs
    std::vector<double> time_steps;               // one number a step
    Viscosity viscosity;                          // derivatives, with the branches of the motion
    double first_step =
        1.0;              // first t of differences; values change by a small fraction of their size over it
    double length = 1.0;  // [m] of the shortest edge
};

/// Holds the tangents of the recorded states.
struct MotionTangent {
    struct State {
        VectorXd q, v, motor_forces;
    };
    std::vector<State> states;
    int factorizations = 0;  // including those of repeated steps
};

/// A motion and its tangent. If there is no tangent, `refusal` says why.
struct MotionWithTangent {
    MotionResult motion;
    MotionTangent tangent;
    std::string refusal;
};

/// Computes a motion in given steps and its tangent at once: each stage is differentiated while its factorization is at hand.
MotionWithTangent simulate_with_tangent(Model& model, const MotionInput& input,
                                        const AdjointStorageOptions& keep, const VectorXd& values,
                                        const MotionInputTangent& along, const MotionWatch& watch = {});

/// Returns the tangents of all recorded states. values: of the scene, in the order of the caller, as the motion was computed with.
/// Throws InvalidInput if the motion was not stored for gradients, and where forces are not smooth.
MotionTangent motion_jvp(Model& model, const MotionInput& input, const MotionResult& motion,
                         const VectorXd& values, const MotionInputTangent& along,
                         const MotionWatch& watch = {});

}  // namespace magshell
