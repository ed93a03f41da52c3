#include "magshell/solve/newton/newton_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

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

bool NewtonIteration::factorize_definite(bool project_psd, double& shift) {
    constexpr double largest_shift = 1.0 / energy_tolerance;  // see test_a_rolling_sheet_takes_whole_steps
    Eigen::MatrixXd no_moves(q_.size(), 0);
    shift = shift > 1.0 ? shift / large_factor : 0.0;
    for (; shift <= largest_shift; shift = std::max(1.0, large_factor * shift)) {
        // The target moves with the weights so that the gradient at q does not change.
        const VectorXd weights = (1.0 + shift) * *proximal_.weights,
                       target = q_ - (q_ - *proximal_.target) / (1.0 + shift);
        const ProximalTerm shifted{&weights, &target, proximal_.motion};
        report_.factor = newton_.factorize(q_, load_parameters_, false, shifted, no_moves, project_psd);
        if (report_.factor.succeeded && report_.factor.negative_pivots == 0) return true;
    }
    return fail("the energy of the stage has no minimum nearby");
}

bool NewtonIteration::begin() {
    if (std::string reason = model_.capabilities().invalid_state_reason(q_); !reason.empty())
        return fail(std::move(reason));
    evaluate();
    return true;
}

namespace {

// Iteration from which on steps must shrink; see test_a_thin_strip_rolled_up.
constexpr int settling_iterations = 6;

// [-] Least tolerance of linear solves whose products are nearly exact: an iteration with exact products takes longer than two with these. What
// is left of a step of the size of the bodies is settled then. See test_newton_converges_alike_by_rough_products.
constexpr double least_by_rough_products = settled_part;

// Returns the tolerance of the linear solve with a nonsymmetric matrix (inexact Newton, N&W 7.1): the forcing term that keeps quadratic
// convergence, and no less than `least` and than the tolerance of the residual needs.
double forcing_term(double residual, double tolerance, double least) {
    return std::max({least, small_part * tolerance / residual, std::min(negligible_part, residual)});
}

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
        if (last_step_ > model_.extent() / settled_step) return !fail("the iteration diverged");
        in_place_ = move_.isZero(0.0);
        const bool settled = report_.residual <= tolerance_ && last_step_ <= settled_step * model_.extent();
        // Below the floor of round-off, small forces that move a thin shell far vanish in larger ones: the last step decides.
        if (in_place_ && settled &&
            ((report_.iterations > 0 && last_step_ <= hidden_part * model_.extent()) ||
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
               last_step_ <= good_part * step_before_ &&
               last_step_ * last_step_ * last_step_ <=
                   std::min(settled_step * report_.first_length, small_part * model_.length_scale()) *
                       step_before_ * step_before_ &&
               report_.factor.negative_pivots <= first_negative_pivots_;
    }

    // Returns true if contact acts in a time stage while the residual does not halve: the iteration then goes between sticking and
    // slipping, or between touching and not, and the methods that follow it take fewer factorizations.
    bool is_slow_in_contact() {
        // Iterations in which the residual must halve; see test_a_stage_with_contact_wastes_few_factorizations, test_counts.py.
        constexpr std::size_t patience = few / 2;
        if (report_.iterations == 0) first_residual_ = report_.residual;
        if (!proximal_.motion || !(report_.had_contact || !model_.contacts().obstacle_points().empty()))
            return false;
        residuals_in_contact_.push_back(report_.residual);
        const std::size_t n = residuals_in_contact_.size();
        return n > patience && report_.residual > progress_part * residuals_in_contact_[n - 1 - patience];
    }

    // Factorizes at the current state. Returns false, with a reason in the report, if the iteration cannot go on.
    bool refactorize(double contraction) {
        // Before the first step the pressure of a liquid belongs to a volume that it will not keep, so the first matrix is projected,
        // unless that changes other terms too, whose exact matrix is needed.
        const bool begins = mixed_ && !extrapolated_ && !model_.capabilities().has_psd_projection;
        // A projected matrix converges linearly. In a time stage with contact the exact one is tried after it.
        const bool alternates = was_projected_ && proximal_.motion && report_.had_contact;
        const bool project_psd = begins || (contraction > progress_part && !alternates);
        was_projected_ = project_psd;
        if (policy_.defers_count) newton_.defer_count();
        report_.factor =
            newton_.factorize(q_, load_parameters_, mixed_ && extrapolated_, proximal_, pull_, project_psd);
        report_.reason = report_.factor.reason;
        if (!report_.factor.succeeded) return false;
        const Index negative_pivots = report_.factor.negative_pivots;
        if (report_.iterations == 0) first_negative_pivots_ = negative_pivots;
        // A solid that a first step overstretches has many more for one iteration.
        report_.diverged = !model_.capabilities().has_transient_instability &&
                           negative_pivots > first_negative_pivots_ + few;
        if (mixed_ && report_.diverged) return fail("the Newton iteration diverged");
        // The pivots of a projected matrix say nothing about stability. The errors of extrapolated stresses are the square of a step over
        // the thickness.
        const bool exact = !project_psd || model_.capabilities().projection_is_exact();
        moved_ = exact && last_step_ <= settled_part * model_.length_scale()
                     ? 0.0
                     : std::numeric_limits<double>::infinity();
        return true;
    }

    // Returns true if the expected iterations with the last factorization are cheaper than a new one.
    bool can_reuse_factor(double contraction) const {
        if (report_.iterations == 0) return policy_.factor && in_place_;
        // [-] Cost of a factorization in iterations that go on from it; see test_kept_factors_serve_all_the_way_back.
        constexpr double worth = 4.0;
        // The error of an iteration with an old factorization is at most twice the last contraction or, in bending, the displacement
        // since then over the thickness.
        const double each = std::max(step_factor * contraction, last_step_ / model_.length_scale());
        return each < small_part && std::log(tolerance_ / report_.residual) >= worth * std::log(each);
    }

    // Returns the least tolerance of a linear solve. Products that are nearly exact suffice while the residual shrinks, and nothing is known of
    // that before the first step.
    double least_tolerance(double contraction) const {
        if (!model_.operators_are_rough()) return 0.0;
        if (report_.iterations == 0)
            return std::max(least_by_rough_products, std::min(negligible_part, std::sqrt(report_.residual)));
        return contraction <= small_part ? least_by_rough_products : 0.0;
    }

    // Loads without potential act on few nodes, so GMRES takes few vectors and solves to the usual tolerance.
    VectorXd solve(const VectorXd& force, double contraction) {
        const bool has_operators = !model_.operators().empty();
        const VectorXd step =
            proximal_.motion || has_operators
                ? newton_.solve_with_factor(
                      force, forcing_term(report_.residual, tolerance_, least_tolerance(contraction)))
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
        VectorXd step = solve(force, contraction);
        if (reused && in_place_ && newton_.contact_force_change(step) > small_part * force.norm()) {
            if (!refactorize(contraction)) return false;
            step = solve(force, contraction);
        }
        const VectorXd from = model_.capabilities().has_barrier && in_place_ ? q_ : VectorXd();
        if (policy_.inexact) last_.from = q_;
        const bool corrects = policy_.correction && report_.iterations == 0 && in_place_;
        if (corrects) report_.tangent = step;
        if (const VectorXd more = corrects ? policy_.correction(step) : VectorXd(); more.size() > 0)
            step += more;
        double alpha = newton_.apply_increment(q_, step, settled_part, report_);
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
        if (const VectorXd more = policy_.landing ? policy_.landing(q_, step) : VectorXd(); more.size() > 0) {
            model_.dof_map().retract(q_, more);
            step += more;
        }
        move_ = newton_.remaining_motion(move_, alpha, q_, load_parameters_);
        if (!is_useful(largest_displacement(model_, step))) return false;
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
        // Steps that settle may pass an unstable state, as corrections in the plane of a shell do.
        if (policy_.stop_on_instability && report_.iterations > 0 &&
            length > std::max(good_part * last_step_, settled_step * model_.extent()) &&
            (report_.factor.negative_pivots > first_negative_pivots_ ||
             (report_.iterations == 1 && length > large_factor * std::max(last_step_, model_.extent()))))
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
// solution. A barrier requires it. In a time stage they always go downhill: a matrix with negative pivots serves no step.
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
        if (!makes_progress()) return fail("the search makes no progress");
        const bool in_place = move_.isZero(0.0);
        // After a projected matrix and a full step, the exact matrix may do; its pivots and its step show whether it does.
        bool project_psd =
            alpha_ < 1.0 || (!was_projected_ && report_.residual > progress_part * last_residual_);
        last_residual_ = report_.residual;
        const VectorXd force = -newton_.gradient(q_, proximal_), from = q_;
        VectorXd step;
        double slope = 0.0;
        for (;; project_psd = true) {
            if (proximal_.motion && in_place && project_psd) {
                if (!factorize_definite(true, shift_)) return false;
                step = newton_.solve_with_factor(force);
            } else {
                Eigen::MatrixXd pull = move_;
                report_.factor = newton_.factorize(q_, load_parameters_, false, proximal_, pull, project_psd);
                if (!report_.factor.succeeded) return fail(report_.factor.reason);
                if (proximal_.motion && in_place && report_.factor.negative_pivots > 0) continue;
                step = move_ + newton_.solve_with_factor(force - pull.col(0));
            }
            slope = force.dot(step);
            if (!in_place || slope > 0.0) break;
            if (!project_psd && !newton_.is_unsymmetric()) continue;
            // Friction that changes with the normal forces can turn a step uphill. The symmetric part of the matrix holds them.
            if (proximal_.motion) step = newton_.solve_with_symmetric_part(force);
            slope = force.dot(step);
            if (slope > 0.0) break;
            if (project_psd) return fail("the energy does not fall along the step");
        }
        was_projected_ = project_psd;
        alpha_ = newton_.apply_increment(q_, step, negligible_length, report_);
        if (alpha_ < 0.0) return false;
        move_ = newton_.remaining_motion(move_, alpha_, q_, load_parameters_);
        evaluate();
        // Near a saddle of the energy a projected matrix is far stiffer than the exact one, and its steps are too short. Close to a
        // solution with friction, which has no energy, longer steps may lead in circles.
        const bool may_lengthen = project_psd && proximal_.motion && alpha_ == 1.0 &&
                                  !(newton_.is_unsymmetric() && last_residual_ <= negligible_part);
        if (in_place)
            alpha_ *= newton_.line_search(
                q_, load_parameters_, proximal_, from, step, alpha_ * slope,
                may_lengthen ? model_.extent() / largest_displacement(model_, step) : 1.0);
        return true;
    }

    // Returns false in a time stage whose least residual has not halved for long: its step is then taken in parts.
    bool makes_progress() {
        // Iterations in which it must halve; see test_a_stage_with_contact_wastes_few_factorizations.
        constexpr int patience = 4 * few;
        if (report_.residual <= progress_part * least_residual_) {
            least_residual_ = report_.residual;
            least_at_ = report_.iterations;
        }
        return !proximal_.motion || report_.iterations - least_at_ <= patience;
    }

    VectorXd move_;  // what is left of the prescribed motion
    double last_residual_ = std::numeric_limits<double>::infinity(), alpha_ = 1.0;
    double least_residual_ = std::numeric_limits<double>::infinity();
    int least_at_ = 0;  // the iteration that had it
    bool was_projected_ = false;
    double shift_ = 0.0;  // of the masses in the last projected matrix
};

}  // namespace

NewtonReport Newton::solve(VectorXd& q, const LoadParameters& load_parameters, const NewtonPolicy& policy) {
    const int max_iterations = policy.max_iterations > 0 ? policy.max_iterations : options_.max_iterations;
    const bool may_search = policy.search_at_barrier && model_.capabilities().has_barrier;
    const VectorXd from = may_search ? q : VectorXd();
    const Model::AngleBranches angle_branches = may_search ? model_.angle_branches() : Model::AngleBranches();
    FullSteps full(*this, q, load_parameters, policy, max_iterations);
    NewtonReport report = full.run();
    if (!may_search || report.converged || !report.had_contact) return report;
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
    report = SearchedSteps(*this, q, load_parameters, policy.proximal, few * max_iterations).run();
    report.iterations += iterations;
    if (!report.converged) describe_contact(report);
    return report;
}

}  // namespace magshell
