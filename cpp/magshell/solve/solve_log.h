// The log of a solve: what was tried, step by step, and what each step cost.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "magshell/solve/newton/newton.h"

namespace magshell {

/// One step of a solve, accepted or not.
struct SolveStep {
    double load_fraction = 0.0;  // of the load path, at the end of the step
    std::string method;
    double displacement = 0.0;  // [m] largest component of a node's; 0 if the step was not accepted
    int factorizations = 0, iterations = 0;
    double energy = std::numeric_limits<double>::quiet_NaN();  // [J] at the end of an accepted step
    Index negative_pivots = 0;  // of the last factorization, with the shift of a descent
    std::string failure{};      // why the step was not accepted; empty if it was
};

/// Records the steps of a solve. The cost of a step is everything that was spent since the step before.
class SolveLog {
  public:
    explicit SolveLog(const Newton& newton) : newton_(newton) {}

    /// Sets the load fraction of the steps that follow.
    void set_load_fraction(double load_fraction) { load_fraction_ = load_fraction; }
    /// Adds a step; load fraction, factorizations and iterations are filled in.
    void record(SolveStep step) {
        step.load_fraction = load_fraction_;
        step.factorizations = newton_.factorizations() - factorizations_;
        step.iterations = newton_.iterations() - iterations_;
        factorizations_ += step.factorizations;
        iterations_ += step.iterations;
        steps_.push_back(std::move(step));
    }
    /// Adds a step only if something was spent on it.
    void record_cost(SolveStep step) {
        if (newton_.factorizations() > factorizations_ || newton_.iterations() > iterations_)
            record(std::move(step));
    }
    const std::vector<SolveStep>& steps() const { return steps_; }

  private:
    const Newton& newton_;
    std::vector<SolveStep> steps_;
    double load_fraction_ = 0.0;
    int factorizations_ = 0, iterations_ = 0;  // up to the last step
};

}  // namespace magshell
