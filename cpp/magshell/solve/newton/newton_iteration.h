// The loop of Newton's method, which all of its variants share: they differ in when they are done and in how they take a step.
#pragma once

#include <string>

#include "magshell/solve/newton/newton.h"
#include "magshell/solve/step_rules.h"

namespace magshell {

class NewtonIteration {
  public:
    virtual ~NewtonIteration() = default;

    /// Iterates on q until is_done() or a step fails; leaves q at the last state.
    NewtonReport run();

  protected:
    /// The references must outlive the iteration.
    NewtonIteration(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                    const ProximalTerm& proximal, int max_iterations)
        : newton_(newton),
          model_(newton.model()),
          q_(q),
          load_parameters_(load_parameters),
          proximal_(proximal),
          max_iterations_(max_iterations) {}

    /// Evaluates the first state. Returns false, with a reason in the report, if there is no energy.
    virtual bool begin();
    /// Returns true if the iteration ends at the state evaluated last, whose residual is in the report; says in the report how.
    virtual bool is_done() = 0;
    /// Takes one step and evaluates its end. Returns false, with a reason in the report, if there is none.
    virtual bool step() = 0;

    /// Factorizes at the current state of a time stage, with the masses in the matrix multiplied by 1 + shift, which is raised until all
    /// pivots are positive. Returns false, with a reason in the report, if no shift does. The gradient stays that of the stage.
    bool factorize_definite(bool project_psd, double& shift);

    void evaluate() { newton_.evaluate(q_, load_parameters_, proximal_); }
    bool fail(std::string reason) {
        report_.reason = std::move(reason);
        return false;
    }

    Newton& newton_;
    Model& model_;
    VectorXd& q_;
    const LoadParameters& load_parameters_;
    const ProximalTerm& proximal_;
    const int max_iterations_;
    NewtonReport report_;
};

}  // namespace magshell
