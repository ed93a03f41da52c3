// Term: the base class of all parts of the energy. One term holds all elements of one kind.
//
// A solver calls one virtual function per term; the loops over elements inside a term are plain templates
// without virtual calls.
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
#include "magshell/terms/capabilities.h"

namespace magshell {

/// One part of the energy. A Newton step calls, in this order: evaluate() at a state; prepare_assembly(),
/// assembly() of all blocks and finish_assembly() at that state, with the state's own stresses (plain Newton)
/// or with extrapolated stresses (mixed Newton); and extrapolate(), once the increment is known.
class Term {
  public:
    virtual ~Term() = default;

    virtual std::string_view name() const = 0;

    /// Returns the body whose element blocks assemble() runs over; -1 if the term has no blocks.
    virtual Index body() const { return -1; }

    /// Reads the parameters that the term uses. Returns true if one of them has changed.
    virtual bool set_values(const Values& values) = 0;

    /// Returns a displacement [m] over which the Hessian changes noticeably, such as a shell's thickness.
    virtual double length_scale() const { return std::numeric_limits<double>::infinity(); }

    /// Returns what a solver must know of the energy. It does not change after construction.
    virtual Capabilities capabilities() const { return {}; }

    /// Returns the largest fraction of the step p from q, at most 1, up to which the term has an energy.
    virtual double max_step_length(const double* /*q*/, const double* /*p*/) const { return 1.0; }
    /// Describes why the term has no energy at q; an empty string if it has one.
    virtual std::string invalid_state_reason(const double* /*q*/) const { return {}; }

    /// Returns true if load parameters enter the energy. The gradient is then linear in them, up to a constant
    /// part. Poses of obstacles do not count: they change only between the steps of a motion.
    virtual bool depends_on_loads() const { return true; }
    /// Returns true if parameters that may change during a solve enter the term.
    virtual bool varies() const { return body() < 0 || depends_on_loads(); }

    /// Returns the energy [J] at q. Does not change the term.
    virtual double energy(const double* q, const LoadParameters& load_parameters) const = 0;

    /// Adds the gradient at q, and stores what assemble() and extrapolate() need of this state.
    virtual void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) = 0;

    /// Switches between the exact Hessian and a positive semidefinite approximation of it, which keeps Newton's
    /// iteration from overshooting (N&W 3.4).
    virtual void set_psd_projection(bool /*project_psd*/) {}

    /// Computes data that assemble() needs at the last evaluated state, such as field samples.
    virtual void prepare_assembly(const double* /*q*/, const LoadParameters&) {}

    /// Adds the part of the Hessian that belongs to one block of elements. Blocks that share no node may be
    /// assembled at the same time.
    virtual void assemble(const ElementBlock&, const double* /*q*/, const LoadParameters&,
                          bool /*extrapolated_stress*/, SystemMatrix& /*out*/) const {}

    /// Adds the part of the Hessian that does not belong to elements of a block.
    virtual void finish_assembly(const double* /*q*/, const LoadParameters&, SystemMatrix& /*out*/) const {}

    /// Adds the nonsymmetric part of the gradient's derivative, which forces without a potential have (follower
    /// loads).
    virtual void add_nonsymmetric_tangent(const double* /*q*/, const LoadParameters&,
                                          NonsymmetricTangent& /*out*/) const {}

    /// Stores the stresses at the end of a linearized step p from the last evaluated state: sigma = C (d + J
    /// p).
    virtual void extrapolate(const double* /*p*/) {}

    /// Adds, per degree of freedom, the magnitude [N] of the forces that cancel within the strains themselves,
    /// as in |a|^2 - |a~|^2 for the reference shape. `beyond` [m] is how much larger the coordinates are than
    /// in the reference shape. The sum bounds the round-off error of the gradient.
    virtual void add_cancelling_forces(double /*beyond*/, VectorXd& /*out*/) const {}

    /// Adds lambda . dg/dk for every parameter and load parameter k on which the term's gradient g depends, at
    /// the last evaluated state q. lambda has one entry per degree of freedom. With dE/dC = 1/2 d d^T, a
    /// stiffness C of a strain d with Jacobian J contributes (J lambda)^T dC/dk d.
    virtual void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                     Gradient& out) = 0;

    /// Returns the unwrapped angles [rad] of the last evaluated state. Positions determine an angle only up to
    /// full turns, so a solver that rejects a state restores the angles with set_angle_branches().
    virtual std::vector<double> angle_branches() const { return {}; }
    virtual void set_angle_branches(const std::vector<double>&) {}

    /// Adds the term's block of the constant matrix of Projective Dynamics (Bouaziz et al. 2014): a matrix
    /// between nodes, the same for x, y and z, that is about as stiff as the term in any state. Returns false
    /// if the term has no such matrix, so that Projective Dynamics cannot be used with it.
    virtual bool add_projective_stiffness(NodeMatrix& /*out*/) const { return true; }
    /// Adds to each node the stiffness [N/m] of the contacts that are active at the last evaluated state.
    virtual void add_contact_stiffness(VectorXd& /*of_nodes*/) const {}

    /// Estimates how far the force of the applied field is off because each element samples the field at one point, relative to
    /// that force or to the couples over the extent [m] of the bodies, from the samples of the last assembly, at about q. NaN if it
    /// cannot be told from them.
    virtual double field_sampling_error(const double* /*q*/, const LoadParameters&, double /*extent*/) {
        return 0.0;
    }

    virtual std::size_t bytes() const = 0;
};

}  // namespace magshell
