#include "magshell/solve/motion/stage_descent.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "magshell/solve/newton/newton_iteration.h"

namespace magshell {
namespace {

// RAII guard that keeps the normal forces of friction fixed, also if an interruption ends its scope.
class ScopedFrozenForces {
  public:
    explicit ScopedFrozenForces(Model& model) : model_(model) { model_.freeze_normal_forces(true); }
    ScopedFrozenForces(const ScopedFrozenForces&) = delete;
    ScopedFrozenForces& operator=(const ScopedFrozenForces&) = delete;
    ~ScopedFrozenForces() { model_.freeze_normal_forces(false); }

  private:
    Model& model_;
};

// Standard Newton steps that lower the energy of a stage, with fixed normal forces of friction, until the residual is below `enough`. Where
// the matrix is indefinite, the masses in it are multiplied by 1 + shift, large enough to make it positive definite.
class DescendingSteps final : public NewtonIteration {
  public:
    /// shift [-]: the one that the descent before ended with; updated for the next descent.
    DescendingSteps(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                    const ProximalTerm& proximal, int max_iterations, double enough, double& shift)
        : NewtonIteration(newton, q, load_parameters, proximal, max_iterations),
          enough_(enough),
          shift_(shift),
          frozen_(newton.model()) {}

  private:
    bool begin() override { return true; }
    bool is_done() override { return report_.residual <= enough_ || report_.iterations == max_iterations_; }

    bool step() override {
        const VectorXd force = -newton_.gradient(q_, proximal_), from = q_;
        if (!factorize_definite(false, shift_)) return false;
        VectorXd step = newton_.solve_with_factor(force);
        if (!(force.dot(step) > 0.0)) return fail("the energy does not fall along the step");
        const double length = largest_displacement(model_, step);
        if (length > model_.extent()) step *= model_.extent() / length;
        if (newton_.apply_increment(q_, step, negligible_length, report_) < 0.0) return false;
        evaluate();
        if (newton_.relative_residual(q_, proximal_) > enough_)
            newton_.line_search(q_, load_parameters_, proximal_, from, step, force.dot(step));
        return true;
    }

    const double enough_;
    double& shift_;
    const ScopedFrozenForces frozen_;
};

}  // namespace

// With fixed normal forces the stage is a minimization, in which steps that go downhill converge. The normal forces are updated between the
// rounds, until standard Newton converges.
NewtonReport descend_in_rounds(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                               const NewtonPolicy& policy) {
    // Largest numbers of rounds, steps downhill in a round, and standard Newton iterations after it; see test_sticks_at_050.
    constexpr int most_rounds = 12, most_steps = 20, last_steps = 8;
    constexpr double least_gain = 1e-2;  // [-] final over first residual; see test_sticks_at_050
    // Rounds in a row without progress after which no more follow, as the normal forces are expected to repeat themselves; see
    // test_a_rolling_sheet_takes_whole_steps.
    constexpr int most_idle_rounds = 3;
    constexpr double progress = 0.5;  // [-] residual over least; see test_a_rolling_sheet_takes_whole_steps
    const ProximalTerm& proximal = policy.proximal;
    NewtonPolicy standard = policy;
    standard.max_iterations = last_steps;
    NewtonReport report;
    VectorXd move = newton.model().dof_map().prescribed_increment(q, load_parameters);
    if (!move.isZero(0.0) && newton.apply_increment(q, move, 1.0, report) < 0.0) return report;
    newton.evaluate(q, load_parameters, proximal);
    double shift = 0.0, least = std::numeric_limits<double>::infinity();
    for (int round = 0, idle = 0; round < most_rounds; ++round) {
        const double begun = newton.relative_residual(q, proximal);
        idle = begun <= progress * least ? 0 : idle + 1;
        least = std::min(least, begun);
        if (idle >= most_idle_rounds) {
            report.residual = begun;
            report.reason = "the normal forces of friction do not settle";
            return report;
        }
        const double enough = std::max(newton.options().tolerance, least_gain * begun);
        const NewtonReport descent =
            DescendingSteps(newton, q, load_parameters, proximal, most_steps, enough, shift).run();
        report.iterations += descent.iterations;
        report.residual = descent.residual;
        report.reason = descent.reason;
        if (!report.reason.empty()) return report;
        VectorXd end = q;
        const NewtonReport last = newton.solve(end, load_parameters, standard);
        report.iterations += last.iterations;
        if (last.converged) {
            q = std::move(end);
            report.converged = true;
            report.residual = last.residual;
            return report;
        }
        newton.evaluate(q, load_parameters, proximal);
        // Standard Newton may come close without converging: the next round then starts there, with the normal forces found there.
        if (last.residual < newton.relative_residual(q, proximal)) {
            q = std::move(end);
            newton.evaluate(q, load_parameters, proximal);
        }
    }
    report.residual = newton.relative_residual(q, proximal);
    report.reason = "no convergence in " + std::to_string(most_rounds) + " rounds of steps downhill";
    return report;
}

}  // namespace magshell
