// ForceTerm: the base class of forces without an energy, such as friction and drag. They depend on velocities,
// so only time steps include them.
//
// At an implicit stage of duration tau that ends at q, velocities follow from q,
//
//   v = (q - x^)/tau,   K = - df/dq - df/dv/tau
//
// where x^ is predicted by the integrator. The force contributes the matrix K to the stage's tangent; K
// is not symmetric in general. Its main symmetric part is added to the system matrix, the rest to the
// nonsymmetric tangent, which only GMRES multiplies by.
//
// What the force acts for may carry momentum p(q, v) beside that of the masses, as water does that a face pushes. The
// stage equation then has the force - (p - p^)/tau, where the integrator predicts p^ as it predicts v^. The model adds that force
// for all terms together; only its derivatives belong to K.
#pragma once

#include "magshell/assembly/nonsymmetric_tangent.h"
#include "magshell/terms/contact/pair_stiffness.h"
#include "magshell/terms/term.h"

namespace magshell {

/// The prediction of a stage for all degrees of freedom, and the stage's duration.
struct StageMotion {
    const VectorXd* x_hat;
    const VectorXd* p_hat;  // of carried momentum [N s]; empty without it
    double time;            // tau [s]
};

/// The state of a stage for all degrees of freedom. v is zero for those that do not belong to a vertex.
struct Kinematics {
    VectorXd q, v;
    VectorXd momentum_rate = {};  // (p - p^)/tau [N]; empty without carried momentum
    double rate = 0.0;            // 1/tau
};

/// Gradients with respect to the arguments of a force other than the end of the stage.
struct KinematicsGradient {
    VectorXd velocity, begin;
    LoadParameters begin_load_parameters;  // load parameters at the beginning of the step
    VectorXd p_hat = {};                   // empty without carried momentum
    double time = 0.0;                     // by tau, where it divides p - p^
};

class ForceTerm {
  public:
    virtual ~ForceTerm() = default;

    virtual std::string_view name() const = 0;

    virtual void set_values(const Values& values) = 0;

    /// Begins a step at q. Lagged friction takes its normal forces from this state.
    virtual void begin_step(const VectorXd& /*q*/, const LoadParameters&) {}

    /// Subtracts the force from `out`, after all energies were evaluated at the same state.
    virtual void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) = 0;

    /// Adds K at the last evaluated state. positive_definite: adds a majorant of the force's dissipation potential
    /// instead of the exact derivatives where there is one, which keeps Newton's iteration from overshooting.
    virtual void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                          SystemMatrix& out, NonsymmetricTangent& rest) const = 0;

    /// Adds, for each frictional pair at the last evaluated state, a positive semidefinite stiffness that
    /// bounds its exact one from above.
    virtual void add_stiffness(const Kinematics& /*at*/, std::vector<PairStiffness>& /*out*/) const {}

    /// Adds, at the last evaluated state, lambda . df/dv and lambda . df/d(begin) to `by`, and - lambda . df/dk to
    /// the gradient with respect to parameters, without the part of carried momentum.
    virtual void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
                     KinematicsGradient& by, Gradient& out) const = 0;

    /// Returns true if it may carry momentum, with other parameters if not with the present ones.
    virtual bool may_have_fluid_momentum() const { return false; }
    /// Adds p(q, v) [N s].
    virtual void add_momentum(const VectorXd& /*q*/, const VectorXd& /*v*/, VectorXd& /*out*/) const {}
    /// Adds lambda . dp/dq, lambda . dp/dv and lambda . dp/dk.
    virtual void momentum_vjp(const VectorXd& /*q*/, const VectorXd& /*v*/, const VectorXd& /*lambda*/,
                              VectorXd& /*by_q*/, VectorXd& /*by_v*/, Gradient& /*out*/) const {}
    /// Returns v . p - T [J] of the kinetic energy T whose derivative by v is p, and adds dT/dq [N] to `by_q` unless that is null.
    virtual double fluid_energy(const VectorXd& /*q*/, const VectorXd& /*v*/, VectorXd* /*by_q*/) const {
        return 0.0;
    }

    /// Adds - lambda . df/dX at the last evaluated state, three numbers per node, of a force that reads the rest shape of bodies.
    virtual void add_rest_vjp(const Kinematics& /*at*/, const VectorXd& /*lambda*/, VectorXd& /*out*/) const {
    }

    /// Freezes the quantities that make the force nonsymmetric (normal forces and normals) at their values of
    /// the last evaluated state, or releases them.
    virtual void set_frozen(bool /*frozen*/) {}

    /// Adds the magnitude [N] of the forces that cancel within velocities at the last evaluated state, a bound
    /// of their round-off.
    virtual void add_cancelling_forces(const Kinematics& /*at*/, VectorXd& /*out*/) const {}
};

}  // namespace magshell
