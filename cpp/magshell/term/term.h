// A term of the energy: all elements of one kind. One virtual call a term, none an element.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "magshell/assembly/element_coloring.h"
#include "magshell/assembly/node_matrix.h"
#include "magshell/assembly/nonsymmetric_tangent.h"
#include "magshell/assembly/out_of_balance.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/core/parameters.h"

namespace magshell {

/// The order of calls in a Newton step: evaluate at a state; the three of the assembly there, with its own
/// stresses (plain Newton) or with the extrapolated ones (mixed); once the increment is known, extrapolate.
class Term {
  public:
    virtual ~Term() = default;

    virtual std::string_view name() const = 0;

    /// The body whose chunks it is assembled by; negative: it has none of them.
    virtual Index body() const { return -1; }

    /// Takes what it reads of the values; whether anything of that has changed.
    virtual bool set_values(const Values& values) = 0;

    /// A displacement [m] that matters to its Hessian: a sheet's thickness.
    virtual double length_scale() const { return std::numeric_limits<double>::infinity(); }

    /// Whether it has no energy in some states, as of elements turned inside out.
    virtual bool has_infeasible_states() const { return false; }
    /// The largest share of a step p from q, at most all of it, up to which it has an energy.
    virtual double max_step_length(const double* /*q*/, const double* /*p*/) const { return 1.0; }
    /// What is wrong with q, in words; empty where nothing is.
    virtual std::string invalid_state_reason(const double* /*q*/) const { return {}; }

    /// Whether the controls drive it, its gradient linear in them but for a constant; poses move in time steps only.
    virtual bool driven() const { return true; }
    /// Whether values that may vary within a solve act in it.
    virtual bool varies() const { return body() < 0 || driven(); }

    /// The energy [J] at q; changes nothing.
    virtual double energy(const double* q, const Controls& controls) const = 0;

    /// Adds the gradient at q and keeps what assemble and extrapolate need of this state.
    virtual void evaluate(const double* q, const Controls& controls, Residual& out) = 0;

    /// From now on, what keeps an iteration from overshooting instead of a Hessian that is not positive, or not.
    virtual void set_psd_projection(bool /*cautious*/) {}

    /// What the Hessian at the last evaluated state needs beforehand.
    virtual void prepare_assembly(const double* /*q*/, const Controls&) {}

    /// Adds a chunk's share of the Hessian; chunks that share no node may run at the same time.
    virtual void assemble(const Chunk&, const double* /*q*/, const Controls&, bool /*extrapolated_stress*/,
                          SystemMatrix& /*out*/) const {}

    /// Adds the share of the Hessian that is not on faces.
    virtual void finish_assembly(const double* /*q*/, const Controls&, SystemMatrix& /*out*/) const {}

    /// Adds what of the derivative of its gradient is not symmetric: of forces that have no potential.
    virtual void add_nonsymmetric_tangent(const double* /*q*/, const Controls&,
                                          NonsymmetricTangent& /*out*/) const {}

    /// Keeps the stresses that a linearized step p from the last evaluated state leads to: sigma = C (d + J p).
    virtual void extrapolate(const double* /*p*/) {}

    /// Adds the magnitude of forces that cancel inside the strains themselves, as for |a|^2 - |a~|^2 at rest,
    /// with coordinates larger than at rest by `beyond` [m].
    virtual void add_cancelling_forces(double /*beyond*/, VectorXd& /*out*/) const {}

    /// Adds lambda . dg/dk at the last evaluated state q for every value and control k that the term's
    /// gradient g depends on; lambda is a vector of all unknowns. With dE/dC = 1/2 d d^T this is (J lambda)^T
    /// dC/dk d for a strain.
    virtual void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) = 0;

    /// Angles [rad] at the last evaluated state with their full turns, which positions do not tell; a solve that rejects it
    /// puts them back.
    virtual std::vector<double> angle_branches() const { return {}; }
    virtual void set_angle_branches(const std::vector<double>&) {}

    /// What Projective Dynamics puts in the place of its Hessian: a matrix of the nodes, the same along x, y and z, about as
    /// stiff as the term in any state. Adds it; false where there is none, and Projective Dynamics cannot do the term.
    virtual bool add_projective_stiffness(NodeMatrix& /*out*/) const { return true; }
    /// Of what touches at the last evaluated state: stiffness [N/m] on the nodes.
    virtual void add_touching_stiffness(VectorXd& /*of_nodes*/) const {}

    virtual std::size_t bytes() const = 0;
};

}  // namespace magshell
