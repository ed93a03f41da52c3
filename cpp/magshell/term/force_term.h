// A force that no energy has: friction, drag. It depends on how the sheet moves, so only time steps see it.
//
// At an implicit stage that ends at q, velocities and accelerations follow from q,
//
//   v = (q - x^)/tau,   w = (v - v^)/tau,   K = - df/dq - df/dv/tau - df/dw/tau^2
//
// and K, the force's share of the stage's matrix, is in general not symmetric. What can well be kept of it in
// the symmetric matrix goes there, the rest into a NonsymmetricTangent.
#pragma once

#include "magshell/assembly/nonsymmetric_tangent.h"
#include "magshell/term/pair_stiffness.h"
#include "magshell/term/term.h"

namespace magshell {

/// How the unknowns move at a stage: what was predicted for it, and its duration.
struct StageMotion {
    const VectorXd *x_hat, *v_hat;
    double time;  // tau [s]
};

/// A state of a stage, of all unknowns; v and w are zero for those that are no vertex.
struct Kinematics {
    VectorXd q, v, w;
    double rate = 0.0;  // 1/tau
};

/// By what a force depends on besides the end of the stage.
struct KinematicsGradient {
    VectorXd velocity, acceleration, begin;
    Controls begin_controls;  // those at the beginning of the step
};

class ForceTerm {
  public:
    virtual ~ForceTerm() = default;

    virtual std::string_view name() const = 0;

    virtual void set_values(const Values& values) = 0;

    /// A step begins at q: what is lagged is taken from here.
    virtual void begin_step(const VectorXd& /*q*/, const Controls&) {}

    /// Subtracts the force, once all energies were evaluated at the same state.
    virtual void evaluate(const Kinematics& at, const Controls& controls, Residual& out) = 0;

    /// Adds K at the last evaluated state. Cautious: what keeps an iteration from overshooting instead of the
    /// exact derivatives, where there is such a thing.
    virtual void assemble(const Kinematics& at, const Controls& controls, bool cautious, SystemMatrix& out,
                          NonsymmetricTangent& rest) const = 0;

    /// Of pairs that touch, at the last evaluated state: what never overshoots.
    virtual void add_stiffness(const Kinematics& /*at*/, std::vector<PairStiffness>& /*out*/) const {}

    /// At the last evaluated state: adds lambda . df/dv, lambda . df/dw and lambda . df/d(begin) to `by`, and
    /// - lambda . df/dk to the gradient.
    virtual void vjp(const Kinematics& at, const Controls& controls, const VectorXd& lambda,
                     KinematicsGradient& by, Gradient& out) const = 0;

    /// From now on, what makes the force unsymmetric stays as it was at the last evaluated state, or does not.
    virtual void hold(bool /*held*/) {}

    /// Adds the magnitude of forces that cancel inside velocities at the last evaluated state.
    virtual void add_cancelling_forces(const Kinematics& /*at*/, VectorXd& /*out*/) const {}
};

}  // namespace magshell
