#include "magshell/solve/statics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/solve/globalization/deflation.h"
#include "magshell/solve/globalization/proximal_continuation.h"
#include "magshell/solve/newton/load_control.h"
#include "magshell/solve/newton/newton_iteration.h"
#include "magshell/solve/nonsymmetric_modes.h"

namespace magshell {
namespace {

// [rad] Largest rotation of a support or an obstacle in one load step, since rotations are known up to full turns; see
// test_an_end_turned_by_180_degrees_twists_the_strip.
constexpr double max_support_rotation = 0.5;
// [-] Shortest load step in which obstacles may move, as a fraction of the load path; see
// test_a_ball_that_moves_by_many_diameters_pushes_the_sheet_along.
constexpr double min_clear_step = negligible_part * negligible_part;

// Moves links to where their joints lead them, for example after the origin of a motor has changed. No force would do that, since
// motors hold in any position.
void project_onto_joints(const Model& model, VectorXd& q) {
    VectorXd projected = q;
    model.dof_map().project_state(projected, nullptr);
    if (largest_displacement(model, projected - q) > energy_tolerance * model.extent())
        q = std::move(projected);
}

class Statics {
  public:
    Statics(Newton& newton, const LoadParameters& from, const LoadParameters& to,
            const StaticsOptions& options, StaticsResult& result)
        : newton_(newton),
          from_(from),
          to_(to),
          options_(options),
          result_(result),
          log_(newton),
          stop_on_instability_(can_stop_on_instability()),
          sides_(newton.model()),
          predictor_(newton.model().n_coordinates()) {}

    bool run() {
        bool found = false;
        newton_.set_max_factorizations(options_.max_factorizations);
        try {
            found = search();
        } catch (const EffortSpent&) {
            newton_.set_max_factorizations(0);
            newton_.model().set_angle_branches(result_.angle_branches);
            result_.effort_spent = true;
            result_.reason = "it gave up after " + std::to_string(newton_.factorizations()) +
                             " factorizations (max_factorizations of the solver)";
            log_.record({.method = "last step", .failure = result_.reason});
        }
        if (!found) finish();
        return found;
    }

    /// Returns what was tried, with what was spent after the last step.
    std::vector<SolveStep> take_log() {
        log_.record_cost({.method = "stability"});
        return log_.steps();
    }

    /// Makes an inexact state exact if the load path ends early.
    void finish() {
        if (!inexact_) return;
        VectorXd trial = result_.state;
        newton_.model().set_angle_branches(result_.angle_branches);
        const NewtonReport report = newton_.solve(trial, load_parameters_at(result_.progress));
        inexact_ = false;
        record("exact solution of the last state", result_.progress, trial, report);
        if (!report.converged) return newton_.model().set_angle_branches(result_.angle_branches);
        result_.state = trial;
        result_.angle_branches = newton_.model().angle_branches();
        result_.residual = report.residual;
    }

  private:
    bool search() {
        load_parameters_at(0.0);
        project_onto_joints(newton_.model(), result_.state);
        sides_.remember(result_.state, from_);
        result_.reason = newton_.model().capabilities().invalid_state_reason(result_.state);
        if (!result_.reason.empty() || !(options_.away_from.empty() ? load() : find_other_equilibrium()))
            return false;
        return result_.stable || !options_.require_stable || relax_to_stable(1.0);
    }

    // Returns true if load steps may stop on instability. Not with moving supports, which pass through saddles, nor where iterations
    // have negative pivots on the way to stable states.
    bool can_stop_on_instability() const {
        const Model& model = newton_.model();
        const Capabilities& has = model.capabilities();
        return options_.start_at_rest && options_.require_stable && !has.has_barrier &&
               !has.has_unsymmetric_tangent && !has.has_transient_instability &&
               model.dof_map().prescribed_increment(result_.state, to_).isZero(0.0);
    }

    // Returns true if the state may be relaxed at the final loads from any state of the load path: there is an energy to descend, and
    // nothing is moved by force.
    bool can_relax_at_once() const {
        const Model& model = newton_.model();
        return options_.start_at_rest && options_.require_stable && options_.watched.empty() &&
               !model.capabilities().has_barrier &&
               model.dof_map().prescribed_increment(result_.state, to_).isZero(0.0);
    }

    // Returns true if shorter load steps would not help after a failed one: a short step fails because the stable branch ends. The load
    // path of solids and cavities costs more than a descent at the final loads.
    bool load_path_has_ended(const LoadStepController& steps, const NewtonReport& report) const {
        if (newton_.is_unsymmetric()) return false;
        const bool pays = stop_on_instability_ && newton_.model().capabilities().has_stress_prediction();
        return !pays || steps.is_short(report);
    }

    // Returns the load parameters at a fraction of the load path, and applies the values that vary to the model.
    LoadParameters load_parameters_at(double progress) {
        LoadParameters there = interpolate(from_, to_, progress);
        newton_.model().parameters().set_time_varying(there);
        return there;
    }

    bool load() {
        if (options_.start_at_rest && from_ == to_ && newton_.is_equilibrium(result_.state, to_))
            accept(result_.state, to_, 1.0, newton_.relative_residual(result_.state, {}));
        const DofMap& dof_map = newton_.model().dof_map();
        load_parameters_at(1.0);
        const double support_rotation =
            std::abs(dof_map.support_factor(to_) - dof_map.support_factor(from_)) *
            dof_map.largest_rotation();
        const double turn = std::max(support_rotation, sides_.turned(to_));
        const double longest_step = turn > max_support_rotation ? max_support_rotation / turn : 1.0;
        LoadStepController steps(options_.first_step, longest_step, options_.smallest_step,
                                 newton_.model().extent(), stop_on_instability_);
        FactorReport factor;  // at the end of the last load step
        bool may_descend = longest_step == 1.0 && can_relax_at_once();
        std::string no_descent;  // why the descent at the final loads fails from the state of the result
        int halvings = 0;        // of a load step that ended beyond an obstacle
        while (result_.progress < 1.0) {
            const double left = 1.0 - result_.progress, step = clear_step(steps.propose(left));
            if (step == 0.0) return false;
            const double target = step < left ? result_.progress + step : 1.0;
            const LoadParameters load_parameters = load_parameters_at(target);
            VectorXd trial = result_.state;
            NewtonReport report =
                solve_load_step(trial, load_parameters, target - result_.progress, target < 1.0);
            const std::string through =
                report.converged ? sides_.crossed(trial, load_parameters) : std::string();
            if (!through.empty()) {
                report.converged = false;
                report.reason = through;
            }
            record("load step", target, trial, report);
            if (report.converged) {
                halvings = 0;
                predictor_.record(result_.state, report.tangent, target - result_.progress);
                accept(trial, load_parameters, target, report.residual);
                inexact_ = report.inexact;
                last_ = std::move(report.stress_predictor);
                factor = report.factor_is_current ? report.factor : FactorReport();
                steps.accept(step, report);
                no_descent.clear();
                continue;
            }
            newton_.model().set_angle_branches(result_.angle_branches);
            result_.reason = report.reason;
            result_.failed.shortest_step = std::min(result_.failed.shortest_step, step);
            if (!through.empty() && ++halvings <= few) {
                steps.reset_to(0.5 * step);
                continue;
            }
            if (through.empty() && may_descend && load_path_has_ended(steps, report)) {
                may_descend = false;
                if (relax_to_stable(1.0)) return true;
                no_descent = result_.reason;
            }
            if (through.empty() && steps.reject(step, report) && options_.start_at_rest) continue;
            // Rotations and obstacles must be followed in steps; other loads may be relaxed at their final values at once.
            factor = {};
            const double relaxed = clear_step(std::min(left, longest_step));
            if (relaxed == 0.0) return false;
            const double end = relaxed < left ? result_.progress + relaxed : 1.0;
            if (stop_on_instability_ || !try_standard_newton(end)) {
                if (end == 1.0 && !no_descent.empty()) {
                    result_.reason = no_descent;
                    return false;
                }
                if (!relax_to_stable(end)) return false;
                if (end == 1.0) return true;
            }
            halvings = 0;
            inexact_ = false;
            last_ = {};
            predictor_.reset();
            steps.reset_to(longest_step);
        }
        return factor.succeeded ? judge(newton_.complete_report()) : check_stability();
    }

    // Shortens a load step until obstacles and supports move through no contact point that stays where it is: beyond it, the
    // penalty would push the point out on the wrong side. Returns zero, and sets the reason, if no step is short enough.
    double clear_step(double step) {
        if (!newton_.model().capabilities().has_stiffness_jumps) return step;
        const double wanted = step;
        for (; step >= min_clear_step * std::min(1.0, wanted); step *= 0.5) {
            const LoadParameters there = load_parameters_at(std::min(1.0, result_.progress + step));
            VectorXd moved = result_.state;
            newton_.model().linearize(moved);
            const VectorXd move = newton_.model().dof_map().prescribed_increment(moved, there);
            newton_.model().dof_map().retract(moved, move);
            result_.reason = sides_.crossed(moved, there);
            if (result_.reason.empty()) return step;
        }
        return 0.0;
    }

    // Adds a step from the state of the result to the log.
    void record(const char* method, double target, const VectorXd& trial, const NewtonReport& report) {
        const Model& model = newton_.model();
        SolveStep step{.method = method, .negative_pivots = report.factor.negative_pivots};
        if (report.converged) {
            step.displacement = largest_displacement(model, trial - result_.state);
            step.energy = model.energy(trial, interpolate(from_, to_, target));
        } else {
            step.failure = report.reason;
        }
        log_.set_load_fraction(target);
        log_.record(std::move(step));
    }

    // Solves one load step; intermediate states need not be exact.
    NewtonReport solve_load_step(VectorXd& q, const LoadParameters& load_parameters, double step,
                                 bool on_the_way) {
        NewtonPolicy policy;
        policy.defers_count = true;
        if (!allows_inexact_steps()) return newton_.solve(q, load_parameters, policy);
        policy.inexact = on_the_way;
        if (newton_.model().capabilities().has_stress_prediction()) policy.stress_predictor = &last_;
        policy.stop_on_instability = stop_on_instability_;
        if (stop_on_instability_)
            policy.correction = [&](const VectorXd& tangent) {
                return predictor_.correction(result_.state, tangent, step);
            };
        return newton_.solve(q, load_parameters, policy);
    }

    bool allows_inexact_steps() const {
        return options_.start_at_rest && !newton_.model().capabilities().has_barrier;
    }

    bool find_other_equilibrium() {
        load_parameters_at(1.0);
        VectorXd trial = result_.state;
        const NewtonReport report =
            solve_away_from(newton_, trial, to_, {options_.away_from, options_.away_length},
                            few / 2 * newton_.options().max_iterations);
        result_.reason = report.reason;
        record("deflated Newton", 1.0, trial, report);
        if (!report.converged) return false;
        accept(trial, to_, 1.0, report.residual);
        return check_stability();
    }

    // Tries standard Newton steps, which may converge for a strongly bent shell if mixed ones do not.
    bool try_standard_newton(double target) {
        if (!newton_.options().mixed) return false;
        VectorXd trial = result_.state;
        const LoadParameters load_parameters = load_parameters_at(target);
        NewtonReport report =
            newton_.solve(trial, load_parameters, {.mixed = false, .search_at_barrier = false});
        if (report.converged) report.reason = sides_.crossed(trial, load_parameters);
        report.converged = report.converged && report.reason.empty();
        record("standard Newton", target, trial, report);
        if (report.converged)
            accept(trial, load_parameters, target, report.residual);
        else
            newton_.model().set_angle_branches(result_.angle_branches);
        return report.converged;
    }

    void accept(const VectorXd& state, const LoadParameters& load_parameters, double progress,
                double residual) {
        result_.state = state;
        result_.factor_is_exact = false;
        result_.angle_branches = newton_.model().angle_branches();
        result_.load_parameters = load_parameters;
        result_.progress = progress;
        result_.residual = residual;
        sides_.remember(state, load_parameters);
        update_at_roundoff();
        ++result_.load_steps;
    }

    // Updates at_roundoff for the state of the result, at which the model was evaluated last.
    void update_at_roundoff() {
        result_.at_roundoff = result_.progress == 1.0 && newton_.relative_residual(result_.state, {}, false) >
                                                             newton_.options().tolerance;
    }

    // Decides about stability by the factorization at the solution, with its own stresses.
    bool check_stability() {
        const FactorReport report = newton_.factorize_at(result_.state, result_.load_parameters);
        result_.factor_is_exact = true;
        return judge(report);
    }

    bool judge(const FactorReport& factor) {
        return judge(factor, count_unstable_directions(newton_, factor));
    }

    bool judge(const FactorReport& factor, Index unstable_directions) {
        result_.unstable_directions = unstable_directions;
        result_.stable = factor.succeeded && unstable_directions == 0 && factor.perturbed_pivots == 0;
        if (!factor.succeeded) result_.reason = factor.reason;
        return factor.succeeded;
    }

    // Relaxes at a load fraction, to a stable state.
    bool relax_to_stable(double target) {
        VectorXd trial = result_.state;
        const LoadParameters load_parameters = load_parameters_at(target);
        RelaxationReport report;
        log_.record_cost({.method = "stability"});
        log_.set_load_fraction(target);
        try {
            report =
                proximal_continuation(newton_, trial, load_parameters, options_.max_relaxation_steps, log_);
        } catch (const EffortSpent&) {
            result_.failed.state = std::move(trial);
            result_.failed.load_parameters = load_parameters;
            throw;
        }
        result_.relaxation_steps += report.steps;
        result_.saddles_escaped += report.saddles_escaped;
        result_.other_branches.insert(result_.other_branches.end(), report.other_branches.begin(),
                                      report.other_branches.end());
        if (!report.converged) {
            newton_.model().set_angle_branches(result_.angle_branches);
            result_.reason = report.reason;
            result_.failed.state = std::move(trial);
            result_.failed.load_parameters = load_parameters;
            result_.failed.last_displacement = report.last_displacement;
            result_.failed.descent_direction = report.descent_direction;
            return false;
        }
        accept(trial, load_parameters, target, report.residual);
        judge(report.factor, 0);
        if (!result_.stable) {
            result_.reason =
                "the equilibrium is neither stable nor unstable: its stiffness matrix is singular";
            return false;
        }
        refine_solution();
        return true;
    }

    // Takes one more step with the factorization at hand, if that reduces the residual.
    void refine_solution() {
        if (newton_.model().capabilities().has_barrier) return;
        const double before = newton_.relative_residual(result_.state, {}, false);
        const VectorXd p = newton_.solve_with_factor(-newton_.gradient(result_.state, {}));
        VectorXd trial = result_.state;
        newton_.model().dof_map().retract(trial, p);
        newton_.evaluate(trial, result_.load_parameters, {});
        const double after = newton_.relative_residual(trial, {}, false);
        // Below the floor, round-off decides which residual is smaller; for a step this short the matrix is more reliable.
        const bool tiny =
            largest_displacement(newton_.model(), p) <= negligible_length * newton_.model().extent();
        if (!(after < before) &&
            !(tiny && newton_.relative_residual(trial, {}) <= newton_.options().tolerance))
            return;
        const bool negligible = newton_.is_negligible(p);
        if (!negligible && !judge(newton_.factorize_at(trial, result_.load_parameters))) {
            // Round-off makes the matrix of a very thin sheet singular there; the state before has a regular one.
            newton_.model().set_angle_branches(result_.angle_branches);
            check_stability();
            return;
        }
        result_.state = trial;
        result_.factor_is_exact = !negligible;
        result_.angle_branches = newton_.model().angle_branches();
        result_.residual = std::min(result_.residual, after);
        update_at_roundoff();
    }

    Newton& newton_;
    const LoadParameters from_, to_;
    const StaticsOptions& options_;
    StaticsResult& result_;
    SolveLog log_;
    const bool stop_on_instability_;  // load steps end at once when they leave the stable states
    bool inexact_ = false;            // whether the last load step ended before full convergence
    StressPredictor last_;            // of the last load step, if it was inexact
    ObstacleSides sides_;             // of the contact points in the state of the result
    LoadPredictor predictor_;
};

}  // namespace

StaticsResult find_equilibrium(Model& model, const VectorXd& start,
                               const Model::AngleBranches& angle_branches, const LoadParameters& from,
                               const LoadParameters& to, const StaticsOptions& options,
                               const StaticsWatch& watch, const TimeVaryingParameters& varying) {
    const ScopedTimeVarying while_varying(model.parameters(), varying);
    const ScopedWatch while_watching(model, options.watched);
    model.set_angle_branches(angle_branches);
    StaticsResult result;
    result.state = start;
    result.angle_branches = angle_branches;
    result.load_parameters = from;
    Newton newton(model, options.newton, [&](double residual) {
        if (watch) watch(result.progress, residual);
    });
    Statics statics(newton, from, to, options, result);
    try {
        result.outcome = statics.run() ? Outcome::converged : Outcome::failed;
        if (result.outcome == Outcome::converged)
            result.field_sampling_error = model.field_sampling_error(result.state, result.load_parameters);
    } catch (const Interrupted&) {
        model.set_angle_branches(result.angle_branches);
        result.outcome = Outcome::interrupted;
        result.reason = "interrupted";
    }
    for (LoadParameters* each : {&result.load_parameters, &result.failed.load_parameters})
        each->conservativeResize(std::max<Index>(0, each->size() - varying.size()));
    result.log = statics.take_log();
    result.iterations = newton.iterations();
    result.factorizations = newton.factorizations();
    result.failed_factorizations = newton.failed_factorizations();
    result.linear_time = newton.linear_time();
    result.bytes = model.bytes();
    if (const std::shared_ptr<Factor>& factor = newton.factor()) {
        result.bytes += factor->bytes();
        result.factorization = factor->name();
    }
    if (options.keep_factor && result.outcome == Outcome::converged && result.stable)
        result.factor = newton.factor();
    return result;
}

}  // namespace magshell
