#include "magshell/solve/newton/newton.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/solve/globalization/contact_predictor.h"
#include "magshell/solve/newton/unsymmetric.h"

namespace magshell {
namespace {

constexpr double round_off = std::numeric_limits<double>::epsilon();

// Returns |part| / (|magnitude| + floor / tolerance). It is below the tolerance if the residual is small compared with the forces
// that cancel in it, or with the round-off of the forces that cancel inside the strains.
double relative(const VectorXd& contact_alpha, const VectorXd& magnitude, const VectorXd& cancelling,
                double tolerance) {
    if (contact_alpha.size() == 0) return 0.0;
    const double scale = magnitude.norm() + 4.0 * round_off / tolerance * cancelling.norm();
    const double length = contact_alpha.norm();
    if (!std::isfinite(length) || !std::isfinite(scale)) return std::numeric_limits<double>::infinity();
    return scale > 0.0 ? length / scale : length > 0.0 ? 1.0 : 0.0;
}

// [-] Last step of a converged iteration, and one below the floor of round-off, over the extent; see test_fine_roof_takes_small_steps.
constexpr double settled_step = 1e-3, last_under_floor = 1e-5;
// New negative pivots above which a shell has diverged (a solid that a first step overstretches has many more for one iteration); see
// test_a_flat_strip_far_beyond_where_it_buckles.
constexpr Index most_new_negative_pivots = 10;
// Iteration from which on steps must shrink, and the largest ratio of successive steps [-]; see test_a_thin_strip_rolled_up.
constexpr int settling_iterations = 6;
constexpr double max_step_ratio = 0.7;  // [-] see test_a_thin_strip_rolled_up
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

// [-] Shortest admissible step length; see test_landing_solid_is_not_inverted.
constexpr double min_step_length = 1e-4;

// Returns the tolerance of the linear solve with a nonsymmetric matrix (inexact Newton, N&W 7.1): the forcing term that keeps quadratic
// convergence, and no less than the tolerance of the residual needs.
double forcing_term(double residual, double tolerance) {
    // [-] Largest forcing term, and safety factor at the end; see test_methods_of_second_order_stick.
    constexpr double max_forcing = 1e-2, final_safety = 0.1;
    return std::max(final_safety * tolerance / residual, std::min(max_forcing, residual));
}

// [-] Displacement over the thickness up to which a factorization stays valid, and up to which the errors of extrapolated stresses, the
// square of the step, are negligible; see test_going_on_gives_the_same_bits.
constexpr double negligible_move = 1e-7, small_move = 1e-4;

// Relative residual and number of vectors of GMRES for gradients with a nearby factorization: the solution of a soft shell has up to
// four digits less than its residual. See test_over_200_steps_against_differences.
constexpr double nearby_gradient_tolerance = 1e-14;  // [-] see test_over_200_steps_against_differences
constexpr int nearby_gradient_vectors = 30;          // see test_over_200_steps_against_differences

// Adds the time it exists to a sum [s].
class Stopwatch {
  public:
    explicit Stopwatch(double& sum) : sum_(sum) {}
    ~Stopwatch() { sum_ += std::chrono::duration<double>(Clock::now() - began_).count(); }

  private:
    using Clock = std::chrono::steady_clock;
    double& sum_;
    Clock::time_point began_ = Clock::now();
};

}  // namespace

Newton::Newton(Model& model, const NewtonOptions& options, Watch watch)
    : model_(model), options_(options), watch_(std::move(watch)) {}

std::shared_ptr<Factor> Newton::release_factor() {
    return std::exchange(factor_, nullptr);
}

VectorXd Newton::gradient(const VectorXd& q, const ProximalTerm& proximal) const {
    VectorXd g = model_.residual().gradient;
    if (proximal.weights) g += proximal.weights->cwiseProduct(q - *proximal.target);
    return g;
}

double Newton::relative_residual(const VectorXd& q, const ProximalTerm& proximal, bool with_floor) const {
    const DofMap& dof_map = model_.dof_map();
    // Only free directions count; rotated nodes are decomposed in their own frames.
    const VectorXd free = dof_map.project(gradient(q, proximal));
    const Index nodes = model_.nodes().first_scalar(), rotations = model_.nodes().scalars;
    VectorXd magnitude = model_.residual().magnitude;
    if (proximal.weights) magnitude += proximal.weights->cwiseProduct(q - *proximal.target).cwiseAbs();
    VectorXd cancelling = model_.cancelling_forces(q);
    // In the inertial force of a short step, positions cancel; links at the end of long arms have larger round-off.
    if (proximal.weights) cancelling += proximal.weights->cwiseProduct(q).cwiseAbs();
    if (const VectorXd rounding = with_floor ? dof_map.rounding(q) : VectorXd(); rounding.size() > 0) {
        const double reach = q.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (reach > 0.0) cancelling += model_.cancelling_forces(q).cwiseProduct(rounding) / reach;
        if (proximal.weights) cancelling += proximal.weights->cwiseProduct(rounding).cwiseAbs();
    }
    model_.add_cancelling_forces_here(proximal.motion != nullptr, cancelling);
    if (!with_floor) cancelling.setZero();
    return std::max(
        relative(free.head(nodes), magnitude.head(nodes), cancelling.head(nodes), options_.tolerance),
        relative(free.tail(rotations), magnitude.tail(rotations), cancelling.tail(rotations),
                 options_.tolerance));
}

void Newton::evaluate(const VectorXd& q, const LoadParameters& load_parameters,
                      const ProximalTerm& proximal) {
    model_.evaluate(q, load_parameters);
    if (proximal.motion) model_.evaluate_forces(q, load_parameters, *proximal.motion);
}

void Newton::assemble(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                      const ProximalTerm& proximal, bool project_psd) {
    model_.assemble(q, load_parameters, extrapolated_stress, project_psd);
    if (proximal.motion) model_.assemble_forces(load_parameters, project_psd);
    unsymmetric_ = model_.unsymmetric();
}

VectorXd Newton::remaining_motion(const VectorXd& move, double alpha, const VectorXd& q,
                                  const LoadParameters& load_parameters) const {
    if (!model_.dof_map().has_motors()) return (1.0 - alpha) * move;
    return model_.dof_map().prescribed_increment(q, load_parameters);  // along the curved paths of motors
}

bool Newton::is_equilibrium(const VectorXd& q, const LoadParameters& load_parameters) {
    evaluate(q, load_parameters, {});
    const bool in_place = model_.dof_map().prescribed_increment(q, load_parameters).isZero(0.0);
    return in_place && relative_residual(q, {}) <= options_.tolerance;
}

NewtonReport Newton::solve(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal) {
    return solve(q, load_parameters, proximal, options_.max_iterations);
}

NewtonReport Newton::solve(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                           int max_iterations) {
    if (!model_.capabilities().has_barrier)
        return iterate(q, load_parameters, proximal, max_iterations, options_.mixed, {});
    constexpr int searched = 5;  // times max_iterations; see test_strip_folds_onto_itself
    const VectorXd from = q;
    const Model::AngleBranches angle_branches = model_.angle_branches();
    NewtonReport report = iterate(q, load_parameters, proximal, max_iterations, options_.mixed, {});
    if (report.converged || !report.had_contact) return report;
    const int iterations = report.iterations;
    // If a step was blocked, the line search continues from there; otherwise the iteration may have led anywhere and starts again.
    if (report.blocked_by.empty()) {
        q = from;
        model_.set_angle_branches(angle_branches);
    }
    report = solve_with_line_search(q, load_parameters, proximal, searched * max_iterations);
    report.iterations += iterations;
    if (!report.converged) describe_contact(report);
    return report;
}

NewtonReport Newton::solve_standard(VectorXd& q, const LoadParameters& load_parameters,
                                    const ProximalTerm& proximal) {
    return iterate(q, load_parameters, proximal, options_.max_iterations, false, {});
}

bool Newton::is_negligible(const VectorXd& step) const {
    return step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>() <=
           negligible_move * model_.length_scale();
}

NewtonReport Newton::solve_until_unstable(VectorXd& q, const LoadParameters& load_parameters,
                                          const LoadStep& load) {
    return iterate(q, load_parameters, {}, options_.max_iterations, options_.mixed, load, true);
}

NewtonReport Newton::solve_load(VectorXd& q, const LoadParameters& load_parameters, const LoadStep& load) {
    return iterate(q, load_parameters, {}, options_.max_iterations, options_.mixed, load);
}

bool Newton::can_reuse_factor(double contraction, double residual, double last_step) const {
    constexpr double worth =
        4.0;  // [-] cost of a factorization in iterations; see test_kept_factors_serve_all_the_way_back
    // The error of an iteration with an old factorization is at most twice the last contraction or, in bending, the displacement since
    // then over the thickness.
    constexpr double max_contraction = 0.1;  // [-] see test_kept_factors_serve_all_the_way_back
    const double each = std::max(2.0 * contraction, last_step / model_.length_scale());
    return each < max_contraction && std::log(options_.tolerance / residual) >= worth * std::log(each);
}

NewtonReport Newton::iterate(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                             int max_iterations, bool mixed, const LoadStep& load, bool stop_on_instability) {
    NewtonReport report;
    if (load.factor) report.factor = *load.factor;
    Index first_negative_pivots = report.factor.negative_pivots;
    VectorXd move = model_.dof_map().prescribed_increment(q, load_parameters);
    bool extrapolated = false;
    double last_step = 0.0, step_before = 0.0, last_residual = std::numeric_limits<double>::infinity();
    double moved = std::numeric_limits<double>::infinity();  // displacement since the last factorization [m]
    StressPredictor last;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model_.invalid_state_reason(q); !reason.empty()) return fail(std::move(reason));
    if (mixed && load.stress_predictor && load.stress_predictor->step.size() > 0) {
        evaluate(load.stress_predictor->from, load_parameters, proximal);
        model_.extrapolate(load.stress_predictor->step);
        extrapolated = true;
    }
    evaluate(q, load_parameters, proximal);
    for (;; ++report.iterations, ++iterations_) {
        report.had_contact |= model_.contacts().has_active_pairs();
        report.residual = relative_residual(q, proximal);
        watch(report.residual);
        if (!std::isfinite(report.residual) || last_step > diverged_step * model_.extent())
            return fail("the iteration diverged");
        const bool in_place = move.isZero(0.0);
        const bool settled =
            report.residual <= options_.tolerance && last_step <= settled_step * model_.extent();
        // Below the floor of round-off, small forces that move a thin shell far vanish in larger ones: the last step decides.
        if (in_place && settled &&
            ((report.iterations > 0 && last_step <= last_under_floor * model_.extent()) ||
             relative_residual(q, proximal, false) <= options_.tolerance)) {
            report.converged = true;
            report.factor_is_current = moved <= negligible_move * model_.length_scale();
            return report;
        }
        // Quadratic convergence predicts the remaining displacement. It must be small compared with the thickness, as it stretches the shell.
        if (load.inexact && in_place && report.iterations > 1 && last_step <= settling_ratio * step_before &&
            last_step * last_step * last_step <=
                std::min(inexact_remainder * report.first_length, inexact_thickness * model_.length_scale()) *
                    step_before * step_before &&
            report.factor.negative_pivots <= first_negative_pivots) {
            report.converged = report.inexact = true;
            report.stress_predictor = std::move(last);
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        Eigen::MatrixXd pull = move;
        const double contraction = report.residual / last_residual;
        last_residual = report.residual;
        // Factorizes at the current state. Returns false, with a reason in the report, if the iteration cannot go on.
        const auto refactorize = [&] {
            // Before the first step the pressure of a liquid belongs to a volume that it will not keep, so the first matrix is projected,
            // unless that changes other terms too, whose exact matrix is needed.
            const bool begins = mixed && !extrapolated && !model_.capabilities().has_psd_projection;
            const bool project_psd = begins || contraction > required_contraction;
            report.factor = factorize(q, load_parameters, mixed && extrapolated, proximal, pull, project_psd);
            report.reason = report.factor.reason;
            if (!report.factor.succeeded) return false;
            const Index negative_pivots = report.factor.negative_pivots;
            if (report.iterations == 0) first_negative_pivots = negative_pivots;
            report.diverged = !model_.capabilities().has_transient_instability &&
                              negative_pivots > first_negative_pivots + most_new_negative_pivots;
            if (mixed && report.diverged) report.reason = "the Newton iteration diverged";
            if (mixed && report.diverged) return false;
            // The pivots of a projected matrix say nothing about stability.
            const bool exact = !project_psd || model_.projection_is_exact();
            moved = exact && last_step <= small_move * model_.length_scale()
                        ? 0.0
                        : std::numeric_limits<double>::infinity();
            return true;
        };
        const bool reused = report.iterations == 0
                                ? load.factor && in_place
                                : can_reuse_factor(contraction, report.residual, last_step);
        if (!reused && !refactorize()) return report;
        // Loads without potential act on few nodes, so GMRES takes few vectors and solves to the usual tolerance.
        const VectorXd force = -gradient(q, proximal) - pull.col(0);
        const auto solved = [&]() -> VectorXd {
            return move + (proximal.motion
                               ? solve_with_factor(force, forcing_term(report.residual, options_.tolerance))
                               : solve_with_factor(force));
        };
        VectorXd step = solved();
        if (reused && in_place &&
            model_.contacts().force_change(touched_, step) > stale_contact * force.norm()) {
            if (!refactorize()) return report;
            step = solved();
        }
        const VectorXd from = model_.capabilities().has_barrier && in_place ? q : VectorXd();
        if (load.inexact) last.from = q;
        const bool corrects = load.correction && report.iterations == 0 && in_place;
        if (corrects) report.tangent = step;
        if (const VectorXd more = corrects ? load.correction(step) : VectorXd(); more.size() > 0)
            step += more;
        double alpha = apply_increment(q, step, min_step_length, report);
        if (alpha < 0.0) return report;
        if (from.size() > 0) {
            double contact_alpha = contact_step_length(from, step, alpha, force.dot(step));
            if (contact_alpha > 1.0)
                contact_alpha =
                    std::max(1.0, contact_alpha * model_.admissible_step_length(from, contact_alpha * step));
            if (contact_alpha != 1.0) {
                alpha *= contact_alpha;
                step *= contact_alpha;
                q = from;
                model_.dof_map().retract(q, step);
            }
        }
        if (proximal.motion && model_.capabilities().has_stiffness_jumps)
            if (const VectorXd more = predict_contact(model_, q, load_parameters, *proximal.weights,
                                                      model_.contacts().predicted_points(step));
                more.size() > 0) {
                model_.dof_map().retract(q, more);
                step += more;
            }
        move = remaining_motion(move, alpha, q, load_parameters);
        const double length = step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (report.iterations == 0) report.first_length = length;
        if (stop_on_instability && report.iterations > 0 &&
            length > std::max(settling_ratio * last_step, settled_step * model_.extent()) &&
            (report.factor.negative_pivots > first_negative_pivots ||
             (report.iterations == 1 && length > max_second_growth * std::max(last_step, model_.extent()))))
            return fail("the iteration leaves the stable states");
        if (mixed && report.iterations >= settling_iterations && length > max_step_ratio * last_step &&
            length > settled_step * model_.extent())
            return fail("the steps of the iteration do not get shorter");
        if (mixed) model_.extrapolate(corrects ? report.tangent : step);
        extrapolated = true;
        if (load.inexact) last.step = step;
        step_before = last_step;
        last_step = length;
        moved += length;
        evaluate(q, load_parameters, proximal);
    }
}

void Newton::check_effort() const {
    // [-] Iterations without a factorization that cost as much as one: each takes a gradient and two triangular solves. See
    // test_bounded_effort.py.
    constexpr int iterations_per_factorization = 20;
    const int without = std::max(0, iterations_ - factorizations_);
    if (max_factorizations_ > 0 &&
        factorizations_ + without / iterations_per_factorization >= max_factorizations_)
        throw EffortSpent();
}

FactorReport Newton::factorize_assembled(const VectorXd& q, const ProximalTerm& proximal) {
    check_effort();
    if (!factor_ || factor_->pattern() != model_.dof_map().pattern()) {
        model_.store_spare_factor(std::exchange(factor_, nullptr));
        factor_ = model_.new_factor([this] { watch(watched_); });
    }
    touched_ = model_.contacts().obstacle_points();
    model_.reduce_matrix(*factor_);
    LargeVector<double>& values = factor_->values();
    if (proximal.weights) model_.dof_map().add_weights(*proximal.weights, values);
    if (model_.dof_map().has_reduced_coordinates())
        model_.dof_map().add_curvature(gradient(q, proximal), values);
    ++factorizations_;
    const Stopwatch running(linear_time_);
    FactorReport report;
    try {
        report = factor_->factorize();
    } catch (const InvalidInput&) {
        report.reason = "the forces are not finite: a face has no area, or lies where a field has no value";
    }
    if (!report.succeeded) ++failed_factorizations_;
    return report;
}

FactorReport Newton::factorize_at(const VectorXd& q, const LoadParameters& load_parameters,
                                  const ProximalTerm& proximal) {
    evaluate(q, load_parameters, proximal);
    assemble(q, load_parameters, false, proximal);
    return factorize_assembled(q, proximal);
}

FactorReport Newton::factorize(const VectorXd& q, const LoadParameters& load_parameters,
                               bool extrapolated_stress, const ProximalTerm& proximal,
                               Eigen::Ref<Eigen::MatrixXd> moves, bool project_psd) {
    assemble(q, load_parameters, extrapolated_stress, proximal, project_psd);
    for (Eigen::Index k = 0; k < moves.cols(); ++k) {
        if (moves.col(k).isZero(0.0)) continue;
        const VectorXd move = moves.col(k);
        VectorXd pull(move.size());
        model_.multiply(move, pull);
        model_.nonsymmetric_tangent().add_product(move, false, pull);
        if (model_.dof_map().has_motors()) {
            if (proximal.weights) pull += proximal.weights->cwiseProduct(move);
            model_.dof_map().add_motor_increment_forces(gradient(q, proximal), move, pull);
        }
        moves.col(k) = pull;
    }
    return factorize_assembled(q, proximal);
}

GmresReport Newton::solve_gmres_adjoint(const VectorXd& q, const LoadParameters& load_parameters,
                                        const ProximalTerm& proximal, const Factor& nearby, VectorXd& rhs) {
    assemble(q, load_parameters, false, proximal);
    const Stopwatch running(linear_time_);
    const DofMap& dof_map = model_.dof_map();
    VectorXd stiffness = model_.diagonal(), whole(model_.size());
    if (proximal.weights) stiffness += *proximal.weights;
    // Scales each dof by the root of its stiffness, so that forces and moments count alike.
    const VectorXd scale = dof_map.weights(stiffness).unaryExpr(
        [](double each) { return each != 0.0 ? 1.0 / std::sqrt(std::abs(each)) : 1.0; });
    const VectorXd forces = dof_map.has_reduced_coordinates() ? gradient(q, proximal) : VectorXd();
    const auto assembled = [&](const VectorXd& x) {
        const VectorXd full = dof_map.expand(x);
        model_.multiply(full, whole);
        if (proximal.weights) whole += proximal.weights->cwiseProduct(full);
        if (unsymmetric_) model_.nonsymmetric_tangent().add_product(full, true, whole);
        VectorXd image = dof_map.vector(whole);
        dof_map.add_curvature_product(forces, x, image);
        return VectorXd(scale.cwiseProduct(image));
    };
    const auto precondition = [&](VectorXd& x) {
        x = x.cwiseQuotient(scale);
        nearby.solve(x);
    };
    VectorXd reduced = scale.cwiseProduct(dof_map.vector(rhs));
    const GmresReport report =
        gmres(assembled, precondition, reduced, {nearby_gradient_tolerance, nearby_gradient_vectors});
    if (report.converged) rhs = dof_map.expand(reduced);
    return report;
}

VectorXd Newton::solve_with_factor(const VectorXd& rhs, double tolerance) const {
    const Stopwatch running(linear_time_);
    VectorXd reduced = model_.dof_map().vector(rhs);
    if (unsymmetric_)
        solve_unsymmetric(model_, *factor_, false, {tolerance, to_round_off.max_iterations}, reduced);
    else
        factor_->solve(reduced);
    return model_.dof_map().expand(reduced);
}

VectorXd Newton::solve_transposed(const VectorXd& rhs) const {
    if (!unsymmetric_) return solve_with_factor(rhs);
    const Stopwatch running(linear_time_);
    VectorXd reduced = model_.dof_map().vector(rhs);
    const GmresReport report = solve_unsymmetric(model_, *factor_, true, to_round_off, reduced);
    if (!report.converged)
        throw InvalidInput(
            "a linear solve with friction, drag, pressure or the torque of a Ball did not converge: its "
            "relative "
            "residual is " +
            std::to_string(report.residual));
    return model_.dof_map().expand(reduced);
}

}  // namespace magshell
