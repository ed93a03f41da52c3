#include "magshell/solve/newton/newton_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "magshell/solve/globalization/contact_predictor.h"

namespace magshell {

NewtonReport NewtonIteration::run() {
    if (!begin()) return report_;
    for (;; ++report_.iterations, newton_.count_iteration()) {
        report_.residual = newton_.relative_residual(q_, proximal_);
        newton_.watch(report_.residual);
        if (!std::isfinite(report_.residual)) {
            fail("the iteration diverged");
            return report_;
        }
        if (is_done()) return report_;
        if (report_.iterations == max_iterations_) {
            fail("no convergence in " + std::to_string(max_iterations_) + " iterations");
            return report_;
        }
        if (!step()) return report_;
    }
}

bool NewtonIteration::begin() {
    if (std::string reason = model_.capabilities().invalid_state_reason(q_); !reason.empty())
        return fail(std::move(reason));
    evaluate();
    return true;
}

namespace {

// [-] Last step below the floor of round-off, over the extent; see test_fine_roof_takes_small_steps.
constexpr double last_under_floor = 1e-5;
// New negative pivots above which a shell has diverged (a solid that a first step overstretches has many more for one iteration); see
// test_a_flat_strip_far_beyond_where_it_buckles.
constexpr Index most_new_negative_pivots = 10;
// Iteration from which on steps must shrink; see test_a_thin_strip_rolled_up.
constexpr int settling_iterations = 6;
// [-] Ratio of steps below which an iteration may pass an unstable state (in-plane corrections do); see test_a_semi_cylinder_pulled_and_pushed.
constexpr double settling_ratio = 0.3;
// [-] Growth of the second step that is allowed, as in the plane of a flat shell; see test_a_flat_strip_far_beyond_where_it_buckles.
constexpr double max_second_growth = 4.0;
// [-] Remaining displacement at which an inexact load step ends, over the first step; see test_state_of_an_early_end_is_an_equilibrium.
constexpr double inexact_remainder = 1e-3;
// [-] The same over the thickness, as a displacement stretches the shell; see test_state_of_an_early_end_is_an_equilibrium.
constexpr double inexact_thickness = 0.1;
// [-] Reduction of the residual below which the next matrix is not projected; see test_strip_folds_onto_itself.
constexpr double required_contraction = 0.5;
// [-] Step over the extent beyond which the iteration has diverged; see test_fields_beyond_all_bounds_end_a_solve.
constexpr double diverged_step = 1e3;
// [-] Change of contact forces, over the residual, that makes a new factorization necessary; see test_an_impact_takes_few_factorizations.
constexpr double stale_contact = 0.1;
// [-] Shortest admissible length of a step with a line search; see test_sheets_pressed_together_by_a_thousand_times_their_weight.
constexpr double min_search_length = 1e-9;
// [-] Length of a step with a projected matrix in a time stage, over Newton's; see test_a_stage_with_contact_wastes_few_factorizations.
constexpr double longest_projected_step = 1024.0;
// [-] Displacement over the thickness up to which the errors of extrapolated stresses, the square of the step, are negligible; see
// test_going_on_gives_the_same_bits.
constexpr double small_move = 1e-4;

// Returns the tolerance of the linear solve with a nonsymmetric matrix (inexact Newton, N&W 7.1): the forcing term that keeps quadratic
// convergence, and no less than the tolerance of the residual needs.
double forcing_term(double residual, double tolerance) {
    // [-] Largest forcing term, and safety factor at the end; see test_methods_of_second_order_stick.
    constexpr double max_forcing = 1e-2, final_safety = 0.1;
    return std::max(final_safety * tolerance / residual, std::min(max_forcing, residual));
}

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

// Full steps, mixed or standard, that stop early where a load step allows or asks for it.
class FullSteps final : public NewtonIteration {
  public:
    FullSteps(Newton& newton, VectorXd& q, const LoadParameters& load_parameters, const NewtonPolicy& policy,
              int max_iterations)
        : NewtonIteration(newton, q, load_parameters, policy.proximal, max_iterations),
          policy_(policy),
          mixed_(policy.mixed && newton.options().mixed),
          tolerance_(newton.options().tolerance) {}

    /// Returns the residual at the first state; 0 if the iteration took no step.
    double first_residual() const { return first_residual_; }

  private:
    bool begin() override {
        if (policy_.factor) report_.factor = *policy_.factor;
        first_negative_pivots_ = report_.factor.negative_pivots;
        move_ = model_.dof_map().prescribed_increment(q_, load_parameters_);
        if (std::string reason = model_.capabilities().invalid_state_reason(q_); !reason.empty())
            return fail(std::move(reason));
        if (mixed_ && policy_.stress_predictor && policy_.stress_predictor->step.size() > 0) {
            newton_.evaluate(policy_.stress_predictor->from, load_parameters_, proximal_);
            model_.extrapolate(policy_.stress_predictor->step);
            extrapolated_ = true;
        }
        evaluate_with_contact();
        return true;
    }

    void evaluate_with_contact() {
        evaluate();
        report_.had_contact |= model_.contacts().has_active_pairs() ||
                               (proximal_.motion && model_.contacts().has_lagged_pairs());
    }

    bool is_done() override {
        if (last_step_ > diverged_step * model_.extent()) return !fail("the iteration diverged");
        in_place_ = move_.isZero(0.0);
        const bool settled = report_.residual <= tolerance_ && last_step_ <= settled_step * model_.extent();
        // Below the floor of round-off, small forces that move a thin shell far vanish in larger ones: the last step decides.
        if (in_place_ && settled &&
            ((report_.iterations > 0 && last_step_ <= last_under_floor * model_.extent()) ||
             newton_.relative_residual(q_, proximal_, false) <= tolerance_)) {
            report_.converged = true;
            report_.factor_is_current = newton_.is_negligible(moved_);
            return true;
        }
        if (!may_end_inexactly()) return false;
        report_.converged = report_.inexact = true;
        report_.stress_predictor = std::move(last_);
        return true;
    }

    // Quadratic convergence predicts the remaining displacement. It must be small compared with the thickness, as it stretches the shell.
    bool may_end_inexactly() const {
        return policy_.inexact && in_place_ && report_.iterations > 1 &&
               last_step_ <= settling_ratio * step_before_ &&
               last_step_ * last_step_ * last_step_ <= std::min(inexact_remainder * report_.first_length,
                                                                inexact_thickness * model_.length_scale()) *
                                                           step_before_ * step_before_ &&
               report_.factor.negative_pivots <= first_negative_pivots_;
    }

    // Returns true if contact acts in a time stage while the residual does not halve: the iteration then goes between sticking and
    // slipping, or between touching and not, and the methods that follow it take fewer factorizations.
    bool is_slow_in_contact() {
        // Iterations in which the residual must halve; see test_a_stage_with_contact_wastes_few_factorizations, test_counts.py.
        constexpr std::size_t patience = 4;
        if (report_.iterations == 0) first_residual_ = report_.residual;
        if (!proximal_.motion || !(report_.had_contact || !model_.contacts().obstacle_points().empty()))
            return false;
        residuals_in_contact_.push_back(report_.residual);
        const std::size_t n = residuals_in_contact_.size();
        return n > patience &&
               report_.residual > required_contraction * residuals_in_contact_[n - 1 - patience];
    }

    // Factorizes at the current state. Returns false, with a reason in the report, if the iteration cannot go on.
    bool refactorize(double contraction) {
        // Before the first step the pressure of a liquid belongs to a volume that it will not keep, so the first matrix is projected,
        // unless that changes other terms too, whose exact matrix is needed.
        const bool begins = mixed_ && !extrapolated_ && !model_.capabilities().has_psd_projection;
        // A projected matrix converges linearly. In a time stage with contact the exact one is tried after it.
        const bool alternates = was_projected_ && proximal_.motion && report_.had_contact;
        const bool project_psd = begins || (contraction > required_contraction && !alternates);
        was_projected_ = project_psd;
        if (policy_.defers_count) newton_.defer_count();
        report_.factor =
            newton_.factorize(q_, load_parameters_, mixed_ && extrapolated_, proximal_, pull_, project_psd);
        report_.reason = report_.factor.reason;
        if (!report_.factor.succeeded) return false;
        const Index negative_pivots = report_.factor.negative_pivots;
        if (report_.iterations == 0) first_negative_pivots_ = negative_pivots;
        report_.diverged = !model_.capabilities().has_transient_instability &&
                           negative_pivots > first_negative_pivots_ + most_new_negative_pivots;
        if (mixed_ && report_.diverged) return fail("the Newton iteration diverged");
        // The pivots of a projected matrix say nothing about stability.
        const bool exact = !project_psd || model_.capabilities().projection_is_exact();
        moved_ = exact && last_step_ <= small_move * model_.length_scale()
                     ? 0.0
                     : std::numeric_limits<double>::infinity();
        return true;
    }

    // Returns true if the expected iterations with the last factorization are cheaper than a new one.
    bool can_reuse_factor(double contraction) const {
        if (report_.iterations == 0) return policy_.factor && in_place_;
        constexpr double worth =
            4.0;  // [-] cost of a factorization in iterations; see test_kept_factors_serve_all_the_way_back
        // The error of an iteration with an old factorization is at most twice the last contraction or, in bending, the displacement
        // since then over the thickness.
        constexpr double max_contraction = 0.1;  // [-] see test_kept_factors_serve_all_the_way_back
        const double each = std::max(2.0 * contraction, last_step_ / model_.length_scale());
        return each < max_contraction && std::log(tolerance_ / report_.residual) >= worth * std::log(each);
    }

    // Loads without potential act on few nodes, so GMRES takes few vectors and solves to the usual tolerance.
    VectorXd solve(const VectorXd& force) {
        const bool has_operators = !model_.operators().empty();
        const VectorXd step =
            proximal_.motion || has_operators
                ? newton_.solve_with_factor(force, forcing_term(report_.residual, tolerance_))
                : newton_.solve_with_factor(force);
        if (has_operators && policy_.defers_count && in_place_ && force.dot(step) < 0.0)
            ++report_.factor.negative_pivots;
        return move_ + step;
    }

    bool step() override {
        if (is_slow_in_contact()) return fail("contact slows the iteration down");
        pull_ = move_;
        const double contraction = report_.residual / last_residual_;
        last_residual_ = report_.residual;
        const bool reused = can_reuse_factor(contraction);
        if (!reused && !refactorize(contraction)) return false;
        const VectorXd force = -newton_.gradient(q_, proximal_) - pull_.col(0);
        VectorXd step = solve(force);
        if (reused && in_place_ && newton_.contact_force_change(step) > stale_contact * force.norm()) {
            if (!refactorize(contraction)) return false;
            step = solve(force);
        }
        const VectorXd from = model_.capabilities().has_barrier && in_place_ ? q_ : VectorXd();
        if (policy_.inexact) last_.from = q_;
        const bool corrects = policy_.correction && report_.iterations == 0 && in_place_;
        if (corrects) report_.tangent = step;
        if (const VectorXd more = corrects ? policy_.correction(step) : VectorXd(); more.size() > 0)
            step += more;
        double alpha = newton_.apply_increment(q_, step, min_step_length, report_);
        if (alpha < 0.0) return false;
        if (from.size() > 0) {
            double contact_alpha = newton_.contact_step_length(from, step, alpha, force.dot(step));
            if (contact_alpha > 1.0)
                contact_alpha = std::max(1.0, contact_alpha * model_.capabilities().admissible_step_length(
                                                                  from, contact_alpha * step));
            if (contact_alpha != 1.0) {
                alpha *= contact_alpha;
                step *= contact_alpha;
                q_ = from;
                model_.dof_map().retract(q_, step);
            }
        }
        if (proximal_.motion && model_.capabilities().has_stiffness_jumps)
            if (const VectorXd more = predict_contact(model_, q_, load_parameters_, *proximal_.weights,
                                                      model_.contacts().predicted_points(step));
                more.size() > 0) {
                model_.dof_map().retract(q_, more);
                step += more;
            }
        move_ = newton_.remaining_motion(move_, alpha, q_, load_parameters_);
        if (!is_useful(step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>())) return false;
        if (mixed_) model_.extrapolate(corrects ? report_.tangent : step);
        extrapolated_ = true;
        if (policy_.inexact) last_.step = std::move(step);
        evaluate_with_contact();
        if (policy_.visit) policy_.visit(q_);
        return true;
    }

    // Takes note of the length of a step [m]. Returns false, with a reason in the report, if the iteration should stop after it.
    bool is_useful(double length) {
        if (report_.iterations == 0) report_.first_length = length;
        if (policy_.stop_on_instability && report_.iterations > 0 &&
            length > std::max(settling_ratio * last_step_, settled_step * model_.extent()) &&
            (report_.factor.negative_pivots > first_negative_pivots_ ||
             (report_.iterations == 1 && length > max_second_growth * std::max(last_step_, model_.extent()))))
            return fail("the iteration leaves the stable states");
        // Standard steps of a user who asks for them take what they need; those in place of mixed ones are given up alike.
        const bool must_settle = mixed_ || (newton_.options().mixed && !proximal_.weights);
        if (must_settle && report_.iterations >= settling_iterations && length > last_step_ &&
            length > settled_step * model_.extent())
            return fail("the steps of the iteration do not get shorter");
        step_before_ = last_step_;
        last_step_ = length;
        moved_ += length;
        return true;
    }

    const NewtonPolicy& policy_;
    const bool mixed_;
    const double tolerance_;
    VectorXd move_;         // what is left of the prescribed motion
    Eigen::MatrixXd pull_;  // the forces that it causes, once the matrix is factorized
    bool in_place_ = false, extrapolated_ = false, was_projected_ = false;
    Index first_negative_pivots_ = 0;
    double last_step_ = 0.0, step_before_ = 0.0;              // [m]
    double moved_ = std::numeric_limits<double>::infinity();  // [m] displacement since the last factorization
    double last_residual_ = std::numeric_limits<double>::infinity(), first_residual_ = 0.0;
    std::vector<double> residuals_in_contact_;
    StressPredictor last_;
};

// Standard steps with a line search on the slope of the energy, with matrices projected to be positive semidefinite far from the
// solution. A barrier requires it.
class SearchedSteps final : public NewtonIteration {
  public:
    SearchedSteps(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                  const ProximalTerm& proximal, int max_iterations)
        : NewtonIteration(newton, q, load_parameters, proximal, max_iterations),
          move_(model_.dof_map().prescribed_increment(q, load_parameters)) {}

  private:
    bool is_done() override {
        report_.converged = move_.isZero(0.0) && report_.residual <= newton_.options().tolerance;
        return report_.converged;
    }

    bool step() override {
        const bool in_place = move_.isZero(0.0);
        // After a projected matrix and a full step, the exact matrix may do; its step shows whether it does.
        bool project_psd =
            alpha_ < 1.0 || (!was_projected_ && report_.residual > required_contraction * last_residual_);
        last_residual_ = report_.residual;
        const VectorXd force = -newton_.gradient(q_, proximal_), from = q_;
        VectorXd step;
        double slope = 0.0;
        for (;; project_psd = true) {
            Eigen::MatrixXd pull = move_;
            report_.factor = newton_.factorize(q_, load_parameters_, false, proximal_, pull, project_psd);
            if (!report_.factor.succeeded) return fail(report_.factor.reason);
            step = move_ + newton_.solve_with_factor(force - pull.col(0));
            slope = force.dot(step);
            if (!in_place || slope > 0.0) break;
            if (project_psd) return fail("the energy does not fall along the step");
        }
        was_projected_ = project_psd;
        alpha_ = newton_.apply_increment(q_, step, min_search_length, report_);
        if (alpha_ < 0.0) return false;
        move_ = newton_.remaining_motion(move_, alpha_, q_, load_parameters_);
        evaluate();
        // Near a saddle of the energy a projected matrix is far stiffer than the exact one, and its steps are too short.
        const bool may_lengthen = project_psd && proximal_.motion && alpha_ == 1.0;
        if (in_place)
            alpha_ *= newton_.line_search(q_, load_parameters_, proximal_, from, step, alpha_ * slope,
                                          may_lengthen ? longest_projected_step : 1.0);
        return true;
    }

    VectorXd move_;  // what is left of the prescribed motion
    double last_residual_ = std::numeric_limits<double>::infinity(), alpha_ = 1.0;
    bool was_projected_ = false;
};

// Standard steps that lower the energy of a stage, with fixed normal forces of friction, until the residual is below `enough`. Where the
// matrix is indefinite, the inertia is multiplied by 1 + shift in it until the step goes downhill.
class DescendingSteps final : public NewtonIteration {
  public:
    /// shift [-]: that of the last step; left for the next descent.
    DescendingSteps(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                    const ProximalTerm& proximal, int max_iterations, double enough, double& shift)
        : NewtonIteration(newton, q, load_parameters, proximal, max_iterations),
          enough_(enough),
          shift_(shift),
          frozen_(newton.model()) {}

  private:
    bool begin() override { return true; }
    bool is_done() override { return report_.residual <= enough_ || report_.iterations == max_iterations_; }

    // Factorizes with the least shift that makes the pivots positive. Returns false, with a reason in the report, if none does.
    bool factorize_definite() {
        // Factor by which the shift is raised and lowered, and the largest one [-]; see test_a_rolling_sheet_takes_whole_steps.
        constexpr double shift_factor = 4.0, largest_shift = 1e12;
        Eigen::MatrixXd no_moves(q_.size(), 0);
        shift_ = shift_ > 1.0 ? shift_ / shift_factor : 0.0;
        for (; shift_ <= largest_shift; shift_ = std::max(1.0, shift_factor * shift_)) {
            // The shift is added about q, so the gradient there stays.
            const VectorXd weights = (1.0 + shift_) * *proximal_.weights,
                           target = q_ - (q_ - *proximal_.target) / (1.0 + shift_);
            const ProximalTerm shifted{&weights, &target, proximal_.motion};
            report_.factor = newton_.factorize(q_, load_parameters_, false, shifted, no_moves, false);
            if (report_.factor.succeeded && report_.factor.negative_pivots == 0) return true;
        }
        return fail("the energy of the stage has no minimum nearby");
    }

    bool step() override {
        const VectorXd force = -newton_.gradient(q_, proximal_), from = q_;
        if (!factorize_definite()) return false;
        VectorXd step = newton_.solve_with_factor(force);
        if (!(force.dot(step) > 0.0)) return fail("the energy does not fall along the step");
        const double length = step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (length > model_.extent()) step *= model_.extent() / length;
        if (newton_.apply_increment(q_, step, min_search_length, report_) < 0.0) return false;
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

NewtonReport Newton::solve(VectorXd& q, const LoadParameters& load_parameters, const NewtonPolicy& policy) {
    if (policy.steps == NewtonPolicy::Steps::descending) return solve_in_rounds(q, load_parameters, policy);
    const int max_iterations = policy.max_iterations > 0 ? policy.max_iterations : options_.max_iterations;
    const bool may_search = policy.search_at_barrier && model_.capabilities().has_barrier;
    const VectorXd from = may_search ? q : VectorXd();
    const Model::AngleBranches angle_branches = may_search ? model_.angle_branches() : Model::AngleBranches();
    FullSteps full(*this, q, load_parameters, policy, max_iterations);
    NewtonReport report = full.run();
    if (!may_search || report.converged || !report.had_contact) return report;
    constexpr int searched = 5;  // times max_iterations; see test_strip_folds_onto_itself
    const int iterations = report.iterations;
    // If a step was blocked, or a time stage came closer to its solution, the line search continues from there; otherwise the iteration
    // may have led anywhere and starts again.
    const auto has_approached = [&] {
        evaluate(q, load_parameters, policy.proximal);
        return relative_residual(q, policy.proximal) < full.first_residual();
    };
    if (report.blocked_by.empty() && !(policy.proximal.motion && has_approached())) {
        q = from;
        model_.set_angle_branches(angle_branches);
    }
    report = SearchedSteps(*this, q, load_parameters, policy.proximal, searched * max_iterations).run();
    report.iterations += iterations;
    if (!report.converged) describe_contact(report);
    return report;
}

// With fixed normal forces the stage is a minimization, in which steps that go downhill converge. The normal forces are updated between the
// rounds, until standard Newton converges.
NewtonReport Newton::solve_in_rounds(VectorXd& q, const LoadParameters& load_parameters,
                                     const NewtonPolicy& policy) {
    // Rounds, steps downhill per round, and standard Newton iterations after each; see test_sticks_at_050.
    constexpr int most_rounds = 12, most_steps = 20, last_steps = 8;
    constexpr double least_gain = 1e-2;  // [-] reduction of the residual in a round; see test_sticks_at_050
    // Rounds in a row without progress after which the normal forces are expected to cycle, and the ratio of residuals [-] that counts as
    // progress; see test_a_rolling_sheet_takes_whole_steps.
    constexpr int most_idle_rounds = 3;
    constexpr double progress = 0.5;  // [-] see test_a_rolling_sheet_takes_whole_steps
    const ProximalTerm& proximal = policy.proximal;
    NewtonReport report;
    VectorXd move = model_.dof_map().prescribed_increment(q, load_parameters);
    if (!move.isZero(0.0) && apply_increment(q, move, 1.0, report) < 0.0) return report;
    evaluate(q, load_parameters, proximal);
    double shift = 0.0, least = std::numeric_limits<double>::infinity();
    for (int round = 0, idle = 0; round < most_rounds; ++round) {
        const double begun = relative_residual(q, proximal);
        idle = begun <= progress * least ? 0 : idle + 1;
        least = std::min(least, begun);
        if (idle >= most_idle_rounds) {
            report.residual = begun;
            report.reason = "the normal forces of friction do not settle";
            return report;
        }
        const double enough = std::max(options_.tolerance, least_gain * begun);
        const NewtonReport descent =
            DescendingSteps(*this, q, load_parameters, proximal, most_steps, enough, shift).run();
        report.iterations += descent.iterations;
        report.residual = descent.residual;
        report.reason = descent.reason;
        if (!report.reason.empty()) return report;
        VectorXd end = q;
        const NewtonPolicy standard{.proximal = proximal, .mixed = false};
        const NewtonReport last = FullSteps(*this, end, load_parameters, standard, last_steps).run();
        report.iterations += last.iterations;
        if (last.converged) {
            q = std::move(end);
            report.converged = true;
            report.residual = last.residual;
            return report;
        }
        evaluate(q, load_parameters, proximal);
        // Standard Newton may come close without converging: the next round then holds the normal forces found there.
        if (last.residual < relative_residual(q, proximal)) {
            q = std::move(end);
            evaluate(q, load_parameters, proximal);
        }
    }
    report.residual = relative_residual(q, proximal);
    report.reason = "no convergence in " + std::to_string(most_rounds) + " rounds of steps downhill";
    return report;
}

}  // namespace magshell
