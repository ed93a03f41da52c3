// Globalization of Newton's method: limits a step to states that have an energy, and searches along it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/solve/newton/newton.h"

namespace magshell {
namespace {

// [-] Reduction of the residual by the last step below which the next matrix is not projected; see test_strip_folds_onto_itself.
constexpr double search_contraction = 0.5;
// [-] Shortest admissible step length of the line search; see test_sheets_pressed_together_by_a_thousand_times_their_weight.
constexpr double min_search_length = 1e-9;
// [-] Step length below which the report names the elements or faces that limit it; see test_relaxation_that_ends_early_reports_contacts.
constexpr double blocked_step_length = 0.1;
// [-] Distance of a trial from the ends of its bracket, over its width; see test_strip_folds_onto_itself.
constexpr double bracket_margin = 0.1;

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

}  // namespace

double Newton::apply_increment(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report) {
    const double alpha = model_.admissible_step_length(q, step);
    if (alpha < shortest) {
        report.reason = model_.describe_blocked_step(q, step);
        return -1.0;
    }
    if (model_.capabilities().has_barrier) {
        report.had_contact |= alpha < 1.0;
        report.blocked_by =
            alpha < blocked_step_length ? model_.describe_blocked_step(q, step) : std::string();
    }
    if (alpha < 1.0) step *= alpha;
    model_.dof_map().retract(q, step);
    return alpha;
}

// Finds a step length at which the slope of the energy is less than half of its initial size, evaluating contact forces only. The
// rest of the energy is taken from its quadratic model, whose slope vanishes at the full step. If the energy still falls fast at
// the full step (the pair was closer than it will stay), the length is doubled, up to 8 steps; if it rises, the zero of the slope
// is bracketed and found by regula falsi (Illinois variant).
double Newton::contact_step_length(const VectorXd& q, const VectorXd& step, double alpha,
                                   double slope) const {
    // [-] Slopes between which the search ends, over the initial slope; see test_strip_folds_onto_itself.
    constexpr double max_rise = 0.5, max_fall = 0.5;
    constexpr int max_trials = 6;  // see test_strip_folds_onto_itself
    // [-] Longest step, and remaining slope below which a longer one is not tried; see test_block_on_a_slope_sticks_or_slides.
    constexpr double longest = 8.0, remaining_slope = 0.2;
    if (!(slope > 0.0)) return 1.0;
    const Contacts& contact = model_.contacts();
    const auto pushed_back = [&](double alpha_contact) {
        VectorXd there = q;
        model_.dof_map().retract(there, alpha_contact * step);
        return contact.slope(there, step);
    };
    const double at_begin = contact.slope(step), stiffness = contact.curvature(step);
    const auto slope_at = [&](double alpha_contact) {
        return (alpha * alpha_contact - 1.0) * slope + pushed_back(alpha_contact) - at_begin -
               alpha_contact * stiffness;
    };
    double lower = 0.0, upper = 1.0, slope_lower = -slope, slope_upper = slope_at(1.0);
    while (alpha == 1.0 && slope_upper < -remaining_slope * slope && upper < longest) {
        lower = upper;
        slope_lower = slope_upper;
        upper *= 2.0;
        slope_upper = slope_at(upper);
    }
    if (slope_upper <= max_rise * slope) return upper;
    for (int trial = 0; trial < max_trials; ++trial) {
        // Contact forces grow faster than linearly, so a secant falls short; the Illinois rule halves the slope of the end that stays.
        const double alpha_contact =
            std::clamp(lower + (upper - lower) * slope_lower / (slope_lower - slope_upper),
                       lower + bracket_margin * (upper - lower), upper - bracket_margin * (upper - lower));
        const double there = slope_at(alpha_contact);
        if (there > max_rise * slope) {
            upper = alpha_contact;
            slope_upper = there;
            slope_lower *= trial > 0 ? 0.5 : 1.0;
        } else if (there < -max_fall * slope) {
            lower = alpha_contact;
            slope_lower = there;
            slope_upper *= 0.5;
        } else {
            return alpha_contact;
        }
    }
    return lower > 0.0 ? lower : upper;
}

void Newton::describe_contact(NewtonReport& report) const {
    if (!report.blocked_by.empty())
        report.reason += "; " + report.blocked_by;
    else if (const std::string hardest = model_.contacts().describe_largest_force(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
}

double Newton::line_search(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                           const VectorXd& from, const VectorXd& step, double slope) {
    constexpr double enough =
        0.5;  // [-] slope at the end over the initial one; see test_strip_folds_onto_itself
    constexpr int max_trials = 12;  // see test_strip_folds_onto_itself
    const auto slope_here = [&] { return gradient(q, proximal).dot(step); };
    double alpha_contact = 1.0, lower = 0.0, upper = 1.0, slope_lower = -slope, slope_upper = slope_here();
    if (slope_upper <= enough * slope) return alpha_contact;
    for (int trial = 0; trial < max_trials; ++trial) {
        // The contact force grows faster than linearly: the Illinois rule halves the slope of the end that stays.
        alpha_contact =
            std::clamp(lower + (upper - lower) * slope_lower / (slope_lower - slope_upper),
                       lower + bracket_margin * (upper - lower), upper - bracket_margin * (upper - lower));
        q = from;
        model_.dof_map().retract(q, alpha_contact * step);
        evaluate(q, load_parameters, proximal);
        const double there = slope_here();
        if (there > enough * slope) {
            upper = alpha_contact;
            slope_upper = there;
            slope_lower *= trial > 0 ? 0.5 : 1.0;
        } else if (there < -enough * slope) {
            lower = alpha_contact;
            slope_lower = there;
            slope_upper *= trial > 0 ? 0.5 : 1.0;
        } else {
            break;
        }
    }
    return alpha_contact;
}

NewtonReport Newton::solve_with_line_search(VectorXd& q, const LoadParameters& load_parameters,
                                            const ProximalTerm& proximal, int max_iterations) {
    NewtonReport report;
    report.reason = model_.invalid_state_reason(q);
    if (!report.reason.empty()) return report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    VectorXd move = model_.dof_map().prescribed_increment(q, load_parameters);
    double last_residual = std::numeric_limits<double>::infinity(), alpha = 1.0;
    bool was_projected = false;
    evaluate(q, load_parameters, proximal);
    for (;; ++report.iterations, ++iterations_) {
        report.residual = relative_residual(q, proximal);
        watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        const bool in_place = move.isZero(0.0);
        if (in_place && report.residual <= options_.tolerance) {
            report.converged = true;
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        // After a projected matrix and a full step, the exact matrix may do; its step shows whether it does.
        bool project_psd =
            alpha < 1.0 || (!was_projected && report.residual > search_contraction * last_residual);
        last_residual = report.residual;
        const VectorXd force = -gradient(q, proximal), from = q;
        VectorXd step;
        double slope = 0.0;
        for (;; project_psd = true) {
            Eigen::MatrixXd pull = move;
            report.factor = factorize(q, load_parameters, false, proximal, pull, project_psd);
            if (!report.factor.succeeded) return fail(report.factor.reason);
            step = move + solve_with_factor(force - pull.col(0));
            slope = force.dot(step);
            if (!in_place || slope > 0.0) break;
            if (project_psd) return fail("the energy does not fall along the step");
        }
        was_projected = project_psd;
        alpha = apply_increment(q, step, min_search_length, report);
        if (alpha < 0.0) return report;
        move = remaining_motion(move, alpha, q, load_parameters);
        evaluate(q, load_parameters, proximal);
        if (in_place) alpha *= line_search(q, load_parameters, proximal, from, step, alpha * slope);
    }
}

// With fixed normal forces the stage is a minimization, in which damped steps converge. The normal forces are updated between the
// rounds, until standard Newton converges.
NewtonReport Newton::solve_damped(VectorXd& q, const LoadParameters& load_parameters,
                                  const ProximalTerm& proximal) {
    // Rounds, damped steps per round, and standard Newton iterations after each; see test_sticks_at_050.
    constexpr int most_rounds = 12, most_steps = 20, last_steps = 8;
    constexpr double least_gain = 1e-2;  // [-] reduction of the residual in a round; see test_sticks_at_050
    NewtonReport report;
    VectorXd move = model_.dof_map().prescribed_increment(q, load_parameters);
    if (!move.isZero(0.0) && apply_increment(q, move, 1.0, report) < 0.0) return report;
    evaluate(q, load_parameters, proximal);
    for (int round = 0; round < most_rounds; ++round) {
        const double enough = std::max(options_.tolerance, least_gain * relative_residual(q, proximal));
        if (!damped_iterations(q, load_parameters, proximal, enough, most_steps, report)) return report;
        VectorXd end = q;
        const NewtonReport last = iterate(end, load_parameters, proximal, last_steps, false, {});
        report.iterations += last.iterations;
        if (last.converged) {
            q = std::move(end);
            report.converged = true;
            report.residual = last.residual;
            return report;
        }
        evaluate(q, load_parameters, proximal);
    }
    report.residual = relative_residual(q, proximal);
    report.reason = "no convergence in " + std::to_string(most_rounds) + " rounds of shortened steps";
    return report;
}

bool Newton::damped_iterations(VectorXd& q, const LoadParameters& load_parameters,
                               const ProximalTerm& proximal, double enough, int most_steps,
                               NewtonReport& report) {
    constexpr double shortest = 1.0 / 4096.0;  // [-] of a step; see test_sticks_at_050
    const ScopedFrozenForces held(model_);
    double last_residual = std::numeric_limits<double>::infinity();
    for (int k = 0; k < most_steps; ++k, ++report.iterations, ++iterations_) {
        report.residual = relative_residual(q, proximal);
        watch(report.residual);
        if (report.residual <= enough) return true;
        if (!std::isfinite(report.residual)) {
            report.reason = "the iteration diverged";
            return false;
        }
        Eigen::MatrixXd no_moves(q.size(), 0);
        const bool project_psd = report.residual > search_contraction * last_residual;
        last_residual = report.residual;
        const FactorReport factor = factorize(q, load_parameters, false, proximal, no_moves, project_psd);
        if (!factor.succeeded) {
            report.reason = factor.reason;
            return false;
        }
        const VectorXd step = solve_with_factor(-gradient(q, proximal)), from = q;
        const auto length = [&](const VectorXd& p) {
            return std::sqrt(p.dot(proximal.weights->cwiseProduct(p)));
        };
        const double whole = length(step);
        for (double alpha = model_.capabilities().has_barrier ? model_.admissible_step_length(q, step) : 1.0;;
             alpha *= 0.5) {
            q = from;
            model_.dof_map().retract(q, alpha * step);
            evaluate(q, load_parameters, proximal);
            if (alpha <= shortest || relative_residual(q, proximal) <= enough) break;
            if (length(solve_with_factor(-gradient(q, proximal))) <= (1.0 - 0.25 * alpha) * whole) break;
        }
    }
    return true;
}

}  // namespace magshell
