#include "magshell/solve/statics.h"

#include <algorithm>
#include <cmath>

#include "magshell/core/errors.h"
#include "magshell/solve/deflation.h"
#include "magshell/solve/load_predictor.h"
#include "magshell/solve/load_steps.h"
#include "magshell/solve/obstacle_sides.h"
#include "magshell/solve/put_in_joints.h"
#include "magshell/solve/relaxation.h"

namespace magshell {
namespace {

// [rad] of a support or an obstacle in one load step: full circles must be gone through
constexpr double longest_turn = 0.5;
// [-] Of the way: the shortest load step in which obstacles may move; fixed by
// test_a_ball_that_moves_by_many_diameters_pushes_the_sheet_along.
constexpr double shortest_clear_step = 1.0 / 4096.0;
// [-] Halves of a load step that ends beyond an obstacle, before the state relaxes there instead.
constexpr int most_halves = 6;

class Statics {
  public:
    Statics(Newton& newton, const Controls& from, const Controls& to, const StaticsOptions& options,
            StaticsResult& result)
        : newton_(newton),
          from_(from),
          to_(to),
          options_(options),
          result_(result),
          wary_(goes_warily()),
          sides_(newton.model()),
          predictor_(newton.model().n_coordinates()) {}

    bool run() {
        bool found = false;
        newton_.give_up_after(options_.max_factorizations);
        try {
            found = search();
        } catch (const EffortSpent&) {
            newton_.give_up_after(0);
            newton_.model().set_turns(result_.turns);
            result_.effort_spent = true;
            result_.reason = "it gave up after " + std::to_string(newton_.factorizations()) +
                             " factorizations (max_factorizations of the solver)";
        }
        if (!found) finish();
        return found;
    }

    /// Where the way ends early, what was reached roughly is made exact.
    void finish() {
        if (!rough_) return;
        VectorXd trial = result_.state;
        newton_.model().set_turns(result_.turns);
        const NewtonReport report = newton_.solve(trial, controls_at(result_.progress));
        rough_ = false;
        if (!report.converged) return newton_.model().set_turns(result_.turns);
        result_.state = trial;
        result_.turns = newton_.model().turns();
        result_.residual = report.residual;
    }

  private:
    bool search() {
        controls_at(0.0);
        put_in_joints(newton_.model(), result_.state);
        sides_.remember(result_.state, from_);
        result_.reason = newton_.model().refusal(result_.state);
        if (!result_.reason.empty() || !(options_.away_from.empty() ? load() : go_elsewhere())) return false;
        return result_.stable || !options_.require_stable || descend(1.0);
    }

    // Supports must be gone along with, through saddles too; solids have unstable directions on the way to stable states.
    bool goes_warily() const {
        const Model& model = newton_.model();
        return options_.start_at_rest && options_.require_stable && !model.has_body_contact() &&
               !model.follows() && model.bodies().solids().empty() &&
               model.reduction().prescribed_increment(result_.state, to_).isZero(0.0);
    }

    // On the way, with what varies in place.
    Controls controls_at(double progress) {
        Controls there = interpolate(from_, to_, progress);
        newton_.model().take(there);
        return there;
    }

    bool load() {
        if (options_.start_at_rest && from_ == to_ && newton_.still_holds(result_.state, to_))
            accept(result_.state, to_, 1.0, newton_.relative_residual(result_.state, {}));
        const Reduction& reduction = newton_.model().reduction();
        controls_at(1.0);
        const double turn =
            std::max(std::abs(reduction.progress(to_) - reduction.progress(from_)) * reduction.largest_turn(),
                     sides_.turned(to_));
        const double longest_step = turn > longest_turn ? longest_turn / turn : 1.0;
        LoadSteps steps(options_.first_step, longest_step, options_.smallest_step, newton_.model().extent(),
                        wary_);
        FactorReport factor;  // at the last load step
        int halves = 0;       // of a load step that ended beyond an obstacle
        while (result_.progress < 1.0) {
            const double left = 1.0 - result_.progress, step = clear_step(steps.next(left));
            if (step == 0.0) return false;
            const double target = step < left ? result_.progress + step : 1.0;
            const Controls controls = controls_at(target);
            VectorXd trial = result_.state;
            NewtonReport report = step_to(trial, controls, target - result_.progress, target < 1.0);
            if (report.converged && strays(report, step)) {
                report.converged = false;
                report.reason = "a step ended on another branch, which is not stable";
            }
            const std::string through = report.converged ? sides_.crossed(trial, controls) : std::string();
            if (!through.empty()) {
                report.converged = false;
                report.reason = through;
            }
            if (report.converged) {
                halves = 0;
                was_stable_ = report.factor.negative_pivots == 0;
                predictor_.went(result_.state, report.tangent, target - result_.progress);
                accept(trial, controls, target, report.residual);
                rough_ = report.rough;
                last_ = std::move(report.last);
                factor = report.in_place ? report.factor : FactorReport();
                steps.succeeded(step, report);
                continue;
            }
            newton_.model().set_turns(result_.turns);
            result_.reason = report.reason;
            result_.failed.shortest_step = std::min(result_.failed.shortest_step, step);
            if (!through.empty() && ++halves <= most_halves) {
                steps.again_with(0.5 * step);
                continue;
            }
            if (through.empty() && steps.failed(step, report) && options_.start_at_rest) continue;
            // What a support turns must be gone through; everything else may be relaxed at its end at once.
            factor = {};
            const double relaxed = clear_step(std::min(left, longest_step));
            if (relaxed == 0.0) return false;
            const double end = relaxed < left ? result_.progress + relaxed : 1.0;
            if ((wary_ || !plain_steps(end)) && !descend(end)) {
                if (wary_ && steps.insist()) continue;
                return false;
            }
            halves = 0;
            rough_ = false;
            last_ = {};
            predictor_.forget();
            steps.again_with(longest_step);
        }
        return factor.succeeded ? judge(factor) : check_stability();
    }

    // Of a load step, the part that moves obstacles and supports through no point that stays where it is: the penalty would
    // push it out on the wrong side. Zero, and the reason, where there is none.
    double clear_step(double step) {
        if (!newton_.model().has_contact()) return step;
        const double wanted = step;
        for (; step >= shortest_clear_step * std::min(1.0, wanted); step *= 0.5) {
            const Controls there = controls_at(std::min(1.0, result_.progress + step));
            VectorXd moved = result_.state;
            newton_.model().linearize(moved);
            const VectorXd move = newton_.model().reduction().prescribed_increment(moved, there);
            newton_.model().reduction().advance(moved, move);
            result_.reason = sides_.crossed(moved, there);
            if (result_.reason.empty()) return step;
        }
        return 0.0;
    }

    // States on the way need not be exact.
    NewtonReport step_to(VectorXd& q, const Controls& controls, double step, bool on_the_way) {
        if (!goes_roughly()) return newton_.solve(q, controls);
        LoadStep load{on_the_way, keeps_stresses() ? &last_ : nullptr};
        if (!wary_) return newton_.solve_load(q, controls, load);
        load.bend = [&](const VectorXd& tangent) { return predictor_.bend(result_.state, tangent, step); };
        return newton_.solve_wary(q, controls, load);
    }

    bool goes_roughly() const { return options_.start_at_rest && !newton_.model().has_body_contact(); }

    // A liquid begins with the pressure of a volume that it is not to have, and a solid with stretched elements.
    bool keeps_stresses() const {
        const Model& model = newton_.model();
        return model.bodies().solids().empty() && model.low_rank().empty();
    }

    bool go_elsewhere() {
        constexpr int times_longer = 3;  // than Newton's way to an equilibrium that is near
        controls_at(1.0);
        VectorXd trial = result_.state;
        const NewtonReport report =
            solve_away_from(newton_, trial, to_, {options_.away_from, options_.away_length},
                            times_longer * newton_.options().max_iterations);
        result_.reason = report.reason;
        if (!report.converged) return false;
        accept(trial, to_, 1.0, report.residual);
        return check_stability();
    }

    // Whether a step from a stable state went far and ended on an unstable branch, that a shorter one may not meet.
    bool strays(const NewtonReport& report, double step) const {
        constexpr double long_step = 0.125;
        constexpr int quick_iterations = 8;
        return options_.start_at_rest && options_.require_stable && was_stable_ && step > long_step &&
               report.iterations > quick_iterations && report.factor.negative_pivots > 0;
    }

    // A sheet bent far already may be too much for the mixed steps, and not for plain ones.
    bool plain_steps(double target) {
        if (!newton_.options().mixed) return false;
        VectorXd trial = result_.state;
        const Controls controls = controls_at(target);
        const NewtonReport report = newton_.solve_plain(trial, controls);
        const bool found = report.converged && sides_.crossed(trial, controls).empty();
        if (found)
            accept(trial, controls, target, report.residual);
        else
            newton_.model().set_turns(result_.turns);
        return found;
    }

    void accept(const VectorXd& state, const Controls& controls, double progress, double residual) {
        result_.state = state;
        result_.turns = newton_.model().turns();
        result_.controls = controls;
        result_.progress = progress;
        result_.residual = residual;
        sides_.remember(state, controls);
        tell_roundoff();
        ++result_.load_steps;
    }

    // Of the result's state, where the model was evaluated last.
    void tell_roundoff() {
        result_.at_roundoff = result_.progress == 1.0 && newton_.relative_residual(result_.state, {}, false) >
                                                             newton_.options().tolerance;
    }

    // The factorization at the solution itself, with its own stresses, decides.
    bool check_stability() { return judge(newton_.factorize_at(result_.state, result_.controls)); }

    bool judge(const FactorReport& factor) {
        result_.unstable_directions = factor.negative_pivots;
        result_.stable = factor.succeeded && factor.negative_pivots == 0 && factor.perturbed_pivots == 0;
        if (!factor.succeeded) result_.reason = factor.reason;
        return factor.succeeded;
    }

    // Relaxes at the controls of `target`. Newton, which finishes a relaxation, may still have been drawn to
    // a saddle: then once more from there.
    bool descend(double target) {
        constexpr int attempts = 5;
        for (int k = 0; k < attempts; ++k) {
            VectorXd trial = result_.state;
            const Controls controls = controls_at(target);
            RelaxationReport report;
            try {
                report =
                    relax(newton_, trial, controls, options_.max_relaxation_steps, options_.start_at_rest);
            } catch (const EffortSpent&) {
                result_.failed.state = std::move(trial);
                result_.failed.controls = controls;
                throw;
            }
            result_.relaxation_steps += report.steps;
            result_.saddles_left += report.saddles_left;
            if (!report.converged) {
                newton_.model().set_turns(result_.turns);
                result_.reason = report.reason;
                result_.failed.state = std::move(trial);
                result_.failed.controls = controls;
                result_.failed.last_move = report.last_move;
                result_.failed.falling = report.falling;
                return false;
            }
            accept(trial, controls, target, report.residual);
            if (!check_stability()) return false;
            if (result_.stable) polish();
            if (result_.stable) return true;
            if (result_.unstable_directions == 0) {
                result_.reason = "the equilibrium is neutral: its Hessian is singular";
                return false;
            }
        }
        result_.reason = "every equilibrium that was found is a saddle";
        return false;
    }

    // One more step, which the factorization that told stability makes cheap, where it brings forces closer to balance.
    void polish() {
        if (newton_.model().has_body_contact()) return;
        const double before = newton_.relative_residual(result_.state, {}, false);
        const VectorXd p = newton_.solve_with_factor(-newton_.gradient(result_.state, {}));
        VectorXd trial = result_.state;
        newton_.model().reduction().advance(trial, p);
        newton_.evaluate(trial, result_.controls, {});
        const double after = newton_.relative_residual(trial, {}, false);
        // Under the floor rounding decides which residual is smaller: of so short a step the matrix knows more.
        constexpr double rounding = 1e-9;  // of the extent
        const bool tiny = p.head(newton_.model().n_coordinates()).lpNorm<Eigen::Infinity>() <=
                          rounding * newton_.model().extent();
        if (!(after < before) &&
            !(tiny && newton_.relative_residual(trial, {}) <= newton_.options().tolerance))
            return;
        result_.state = trial;
        result_.turns = newton_.model().turns();
        result_.residual = std::min(result_.residual, after);
        tell_roundoff();
        if (!newton_.negligible(p)) check_stability();
    }

    Newton& newton_;
    const Controls from_, to_;
    const StaticsOptions& options_;
    StaticsResult& result_;
    const bool wary_;         // load steps are given up at once where they leave the stable states
    bool was_stable_ = true;  // where the last load step ended
    bool rough_ = false;      // whether it ended before it was exact
    LastStep last_;           // of that
    ObstacleSides sides_;     // at the result's state
    LoadPredictor predictor_;
};

}  // namespace

StaticsResult find_equilibrium(Model& model, const VectorXd& start, const Model::Turns& turns,
                               const Controls& from, const Controls& to, const StaticsOptions& options,
                               const StaticsWatch& watch, const Varying& varying) {
    const WhileVarying while_varying(model, varying);
    model.set_turns(turns);
    StaticsResult result;
    result.state = start;
    result.turns = turns;
    result.controls = from;
    Newton newton(model, options.newton, [&](double residual) {
        if (watch) watch(result.progress, residual);
    });
    try {
        Statics statics(newton, from, to, options, result);
        result.outcome = statics.run() ? Outcome::converged : Outcome::failed;
    } catch (const Interrupted&) {
        model.set_turns(result.turns);
        result.outcome = Outcome::interrupted;
        result.reason = "interrupted";
    }
    for (Controls* each : {&result.controls, &result.failed.controls})
        each->conservativeResize(std::max<Index>(0, each->size() - varying.size()));
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
