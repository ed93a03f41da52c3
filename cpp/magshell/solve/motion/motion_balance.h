// The balance of a motion: where its energy, momentum and angular momentum come from and go.
//
// The steps of a motion are repeated. The work, impulse and angular impulse of each force f are sums over their stages,
//
//   W = dt sum_j b_j f_j . v_j,    P = dt sum_j b_j sum f_j,    L = dt sum_j b_j sum x_j x f_j
//
// with the weights b_j of the end of the step (tableau.h). They are the results of the method itself for W' = f . v, P' = sum f and
// L' = sum x x f as further equations of the motion, and thus of its order. P equals the change of the momentum up to round-off.
// A potential V(x, p) of which something else changes the parameters p gets the work dV/dp p'; p' is the derivative of the polynomial
// through the parameters of the step.
//
// Implicit contact (tableau.h) acts from the end of a step over all of it: W = dt (v_begin + v_end)/2 . f, with the levers at the end.
// Supports move masses at given velocities; the work for that is the change of their kinetic energy, whatever the stages have.
#pragma once

#include <string>

#include "magshell/solve/motion/dynamics.h"

namespace magshell {

struct MotionBalance {
    /// A row for each force: work [J], impulse [N s] and angular impulse about the origin [N m s] since the start.
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>;

    /// The sums until a recorded state, and the energies and momenta there. forces: the forces of the terms, of the terms without
    /// energy, and those of `further_forces`. energies: [J] of the terms, then of the Maxwell branches. driven: [J] work on the energy of
    /// each term by parameters that change. momenta: momentum [N s], and angular momentum about the origin [N m s].
    struct State {
        Rows forces;
        VectorXd energies, driven;
        double kinetic = 0.0;
        Eigen::Matrix<double, 6, 1> momenta = Eigen::Matrix<double, 6, 1>::Zero();
    };

    /// Forces that are no terms: those of damping, of the two kinds of viscosity, of dampers, of supports, of the ground on joints, of
    /// motors, and what is left over of all on the free unknowns (of hard contact, if that is how contact is solved).
    enum FurtherForce {
        damping,
        stiffness_damping,
        maxwell,
        dampers,
        supports,
        joints,
        motors,
        left_over,
        further_forces
    };

    std::vector<State> states;  // recorded
    VectorXd last;              // the state at the end
};

/// Repeats a motion from its start and returns its balance. substeps: those of the steps that were divided. Throws InvalidInput if a step
/// cannot be repeated.
MotionBalance motion_balance(Model& model, const MotionInput& input,
                             const std::map<Index, Substeps>& substeps, Index steps_done,
                             const MotionWatch& watch = {});

}  // namespace magshell
