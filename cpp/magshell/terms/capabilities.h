// Capabilities: what a solver must know of an energy besides its values and derivatives.
//
// Every term answers for itself, and the model joins the answers. Solvers ask for these properties only, never for kinds of bodies or
// terms, so that a new term needs no change in a solver.
#pragma once

namespace magshell {

/// Each answer is false for a smooth energy that is defined everywhere, such as that of a load.
struct Capabilities {
    /// Some states have no energy, such as those with inverted elements. Term::max_step_length() limits steps.
    bool has_infeasible_states = false;
    /// The energy grows without bound towards infeasible states. Steps need a line search and end before such states, so the
    /// displacements of two steps cannot be compared.
    bool has_barrier = false;
    /// The stiffness jumps within a step, as that of a penalty for penetration does: damped steps converge where full ones do not.
    bool has_stiffness_jumps = false;
    /// Term::set_psd_projection() changes the Hessian. It is then not exact, and its pivots say nothing about stability.
    bool has_psd_projection = false;
    /// The Hessian has negative pivots on the way to stable states too, such as that of solid elements that a first step overstretches.
    bool has_transient_instability = false;
    /// The stresses that a load step extrapolates are no good start of the next one, as its elements are stretched at first.
    bool has_transient_stresses = false;
    /// The tangent may be unsymmetric (Term::add_nonsymmetric_tangent()), and then there is no energy.
    bool has_unsymmetric_tangent = false;
    /// Forces that depend on velocities act within time steps.
    bool has_velocity_forces = false;
    /// The energy is viscous by itself, without the viscosity of the scene.
    bool has_own_viscosity = false;

    /// Joins the answers of several terms: what holds for one of them holds for all together.
    Capabilities& operator|=(const Capabilities& other) {
        has_infeasible_states |= other.has_infeasible_states;
        has_barrier |= other.has_barrier;
        has_stiffness_jumps |= other.has_stiffness_jumps;
        has_psd_projection |= other.has_psd_projection;
        has_transient_instability |= other.has_transient_instability;
        has_transient_stresses |= other.has_transient_stresses;
        has_unsymmetric_tangent |= other.has_unsymmetric_tangent;
        has_velocity_forces |= other.has_velocity_forces;
        has_own_viscosity |= other.has_own_viscosity;
        return *this;
    }
};

}  // namespace magshell
