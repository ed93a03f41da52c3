#include "magshell/solve/newton/newton.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/core/bracket.h"
#include "magshell/core/errors.h"
#include "magshell/solve/newton/newton_iteration.h"
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

void Newton::give_up_factor() {
    if (factor_.use_count() == 1) model_.store_spare_factor(std::move(factor_));
    factor_ = nullptr;
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

double Newton::apply_increment(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report) {
    const double alpha = model_.capabilities().admissible_step_length(q, step);
    if (alpha < shortest) {
        report.reason = model_.capabilities().describe_blocked_step(q, step);
        return -1.0;
    }
    if (model_.capabilities().has_barrier) {
        report.had_contact |= alpha < 1.0;
        report.blocked_by =
            alpha < small_part ? model_.capabilities().describe_blocked_step(q, step) : std::string();
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
    Bracket ends{0.0, -slope, 1.0, slope_at(1.0)};
    while (alpha == 1.0 && ends.at_upper < -good_part * slope && ends.upper < largest_factor)
        ends = {ends.upper, ends.at_upper, step_factor * ends.upper, slope_at(step_factor * ends.upper)};
    if (ends.at_upper <= progress_part * slope) return ends.upper;
    for (int trial = 0; trial < few; ++trial) {
        // Contact forces grow faster than linearly, so a secant falls short; the Illinois rule halves the slope of the end that stays.
        const double alpha_contact = ends.secant_zero(small_part), there = slope_at(alpha_contact);
        if (there > progress_part * slope)
            ends.move_upper(alpha_contact, there, trial > 0 ? progress_part : 1.0);
        else if (there < -progress_part * slope)
            ends.move_lower(alpha_contact, there, progress_part);
        else
            return alpha_contact;
    }
    return ends.lower > 0.0 ? ends.lower : ends.upper;
}

void Newton::describe_contact(NewtonReport& report) const {
    if (!report.blocked_by.empty())
        report.reason += "; " + report.blocked_by;
    else if (const std::string hardest = model_.contacts().describe_largest_force(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
}

double Newton::line_search(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                           const VectorXd& from, const VectorXd& step, double slope, double longest) {
    const auto slope_here = [&] { return gradient(q, proximal).dot(step); };
    const auto slope_at = [&](double length) {
        q = from;
        model_.dof_map().retract(q, length * step);
        evaluate(q, load_parameters, proximal);
        return slope_here();
    };
    double alpha_contact = 1.0;
    Bracket ends{0.0, -slope, 1.0, slope_here()};
    while (ends.at_upper < -progress_part * slope && step_factor * ends.upper <= longest) {
        const double ahead = step_factor * ends.upper;
        if (model_.capabilities().admissible_step_length(from, ahead * step) < 1.0) return ends.upper;
        ends = {ends.upper, ends.at_upper, ahead, slope_at(ahead)};
    }
    if (ends.at_upper <= progress_part * slope) return ends.upper;
    for (int trial = 0; trial < few; ++trial) {
        // The contact force grows faster than linearly: the Illinois rule halves the slope of the end that stays.
        alpha_contact = ends.secant_zero(small_part);
        const double there = slope_at(alpha_contact);
        if (!(std::abs(there) > progress_part * slope)) break;
        if (there > 0.0)
            ends.move_upper(alpha_contact, there, trial > 0 ? progress_part : 1.0);
        else
            ends.move_lower(alpha_contact, there, trial > 0 ? progress_part : 1.0);
    }
    return alpha_contact;
}

bool Newton::is_equilibrium(const VectorXd& q, const LoadParameters& load_parameters) {
    evaluate(q, load_parameters, {});
    const bool in_place = model_.dof_map().prescribed_increment(q, load_parameters).isZero(0.0);
    return in_place && relative_residual(q, {}) <= options_.tolerance;
}

bool Newton::is_negligible(double displacement) const {
    return displacement <= small_part * hidden_part * model_.length_scale();
}

bool Newton::is_negligible(const VectorXd& step) const {
    return is_negligible(largest_displacement(model_, step));
}

void Newton::check_effort() const {
    const int without = std::max(0, iterations_ - factorizations_);
    if (max_factorizations_ > 0 &&
        factorizations_ + without / iterations_per_factorization >= max_factorizations_)
        throw EffortSpent();
}

FactorReport Newton::factorize_assembled(const VectorXd& q, const ProximalTerm& proximal) {
    check_effort();
    if (!factor_ || factor_.use_count() > 1 || factor_->pattern() != model_.dof_map().pattern()) {
        give_up_factor();
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
    factor_->set_count_deferred(std::exchange(defers_count_, false));
    try {
        report = factor_->factorize();
    } catch (const InvalidInput&) {
        report.reason = "the forces are not finite: a face has no area, or lies where a field has no value";
    }
    if (!report.succeeded) ++failed_factorizations_;
    return report;
}

FactorReport Newton::complete_report() const {
    const Stopwatch running(linear_time_);
    return factor_->complete_report();
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
        factor_->solve_approximately(reduced, tolerance);
    return model_.dof_map().expand(reduced);
}

VectorXd Newton::solve_with_symmetric_part(const VectorXd& rhs) const {
    const Stopwatch running(linear_time_);
    VectorXd reduced = model_.dof_map().vector(rhs);
    factor_->solve(reduced);
    return model_.dof_map().expand(reduced);
}

VectorXd Newton::solve_transposed(const VectorXd& rhs) const {
    if (!unsymmetric_) return solve_with_factor(rhs, to_round_off.tolerance);
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
