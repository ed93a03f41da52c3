// First-order displacement under small loads: of a scene in its reference configuration (linear theory, with one factorization), and
// of an equilibrium whose factorization is at hand.
#pragma once

#include <optional>

#include "magshell/scene/model.h"
#include "magshell/solve/statics.h"

namespace magshell {

struct SmallDeflection {
    VectorXd motion;      // of all dofs; empty if the stiffness is not positive definite
    FactorReport report;  // of the factorization
    Index unknowns = 0;   // size of the matrix that was factorized
};

/// Returns dm + du, where K du = g(unloaded) - g(load_parameters) - K dm, all of all dofs: K is the Hessian and g the gradient at the
/// reference shape q, K without loads, and dm the motion of supports and motors. at_rest replaces g(unloaded) if given.
/// Parts that no stiffness couples to a force stay in place and need no support. Throws InvalidInput if K is not symmetric.
SmallDeflection small_deflection(Model& model, const VectorXd& q, const LoadParameters& unloaded,
                                 const LoadParameters& load_parameters,
                                 const std::optional<VectorXd>& at_rest = {});

/// Returns the change of all dofs from an equilibrium with a stored factorization to the load parameters `to` and to the parameters
/// that the model has now: the first Newton step with the old Hessian. Throws InvalidInput if no factorization was stored.
VectorXd first_order_change(Model& model, const StaticsResult& equilibrium, const LoadParameters& to);

/// A state q, and forces on all dofs, after the parameters of joints have changed.
struct StateOnJoints {
    VectorXd moved;   // q, with rigid bodies on their joints again
    VectorXd driven;  // the increments of all dofs from there to the targets of supports and motors
    VectorXd forces;  // on the free dofs there
};

/// Computes it with the parameters that the model has now. Linearizes the reduced coordinates there.
StateOnJoints state_on_joints(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                              const VectorXd& forces);

/// Returns true if solve_at_equilibrium() needs the Hessian, assembled at the equilibrium.
bool needs_hessian(const Model& model, const StaticsResult& equilibrium);
/// Replaces a vector of the free dofs by K^-1 or K^-T of it, to round-off. K: the Hessian of an equilibrium with a stored factorization,
/// where the model was evaluated last. A factorization of a state nearby is corrected with K itself. Throws InvalidInput if GMRES does
/// not converge.
void solve_at_equilibrium(const Model& model, const StaticsResult& equilibrium, bool transposed,
                          VectorXd& reduced);

/// The derivatives along a direction of the parameters: of the gradient at the fixed state and of what supports and motors
/// prescribe, of all dofs; and of a state that stays on its joints and of the forces of the fixed gradient on the free dofs there, both
/// empty if no joint changes.
struct ChangeAlong {
    VectorXd gradient, prescribed, moved = {}, forces = {};
};

/// Returns the derivative of all dofs: H dq_f = -(dg + H_fh dq_h). The model must have the parameters of the equilibrium. Throws
/// InvalidInput if no factorization was stored.
VectorXd equilibrium_jvp(Model& model, const StaticsResult& equilibrium, ChangeAlong change);

}  // namespace magshell
