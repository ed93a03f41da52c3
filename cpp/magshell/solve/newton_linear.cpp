// What Newton does with its matrix: factorize it, and solve with it.
#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/solve/newton.h"
#include "magshell/solve/unsymmetric.h"

namespace magshell {
namespace {

// Of solves for gradients with a factorization from nearby: a soft sheet's solution has up to four digits less than its residual.
constexpr double nearby_gradient_tolerance = 1e-14;
constexpr int nearby_gradient_vectors = 30;

// Adds the time it lives to a sum.
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

void Newton::spend() const {
    // [-] Iterations without a factorization of their own that cost as much as one: a gradient and two triangular solves each.
    constexpr int iterations_a_factorization = 20;
    const int without = std::max(0, iterations_ - factorizations_);
    if (most_factorizations_ > 0 &&
        factorizations_ + without / iterations_a_factorization >= most_factorizations_)
        throw EffortSpent();
}

FactorReport Newton::factorize_assembled(const VectorXd& q, const Anchor& anchor) {
    spend();
    if (!factor_ || factor_->pattern() != model_.reduction().pattern()) {
        model_.keep_spare(std::exchange(factor_, nullptr));
        factor_ = model_.new_factor([this] { watch(watched_); });
    }
    if (model_.has_contact()) touched_ = model_.contact()->evaluated_contacts();
    model_.reduce_matrix(*factor_);
    LargeVector<double>& values = factor_->values();
    if (anchor.weights) model_.reduction().add_weights(*anchor.weights, values);
    if (model_.reduction().carries()) model_.reduction().add_curvature(gradient(q, anchor), values);
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

FactorReport Newton::factorize_at(const VectorXd& q, const Controls& controls, const Anchor& anchor) {
    evaluate(q, controls, anchor);
    assemble(q, controls, false, anchor);
    return factorize_assembled(q, anchor);
}

FactorReport Newton::factorize(const VectorXd& q, const Controls& controls, bool extrapolated_stress,
                               const Anchor& anchor, Eigen::Ref<Eigen::MatrixXd> moves, bool cautious) {
    assemble(q, controls, extrapolated_stress, anchor, cautious);
    for (Eigen::Index k = 0; k < moves.cols(); ++k) {
        if (moves.col(k).isZero(0.0)) continue;
        const VectorXd move = moves.col(k);
        VectorXd pull(move.size());
        model_.multiply(move, pull);
        model_.remainder().add_product(move, false, pull);
        if (model_.reduction().drives()) {
            if (anchor.weights) pull += anchor.weights->cwiseProduct(move);
            model_.reduction().add_driven_forces(gradient(q, anchor), move, pull);
        }
        moves.col(k) = pull;
    }
    return factorize_assembled(q, anchor);
}

GmresReport Newton::solve_nearby(const VectorXd& q, const Controls& controls, const Anchor& anchor,
                                 const Factor& nearby, VectorXd& rhs) {
    assemble(q, controls, false, anchor);
    const Stopwatch running(linear_time_);
    const Reduction& reduction = model_.reduction();
    VectorXd stiffness = model_.diagonal(), whole(model_.size());
    if (anchor.weights) stiffness += *anchor.weights;
    // Forces of different kinds count alike, whatever their units.
    const VectorXd scale = reduction.weights(stiffness).unaryExpr(
        [](double each) { return each != 0.0 ? 1.0 / std::sqrt(std::abs(each)) : 1.0; });
    const VectorXd forces = reduction.carries() ? gradient(q, anchor) : VectorXd();
    const auto assembled = [&](const VectorXd& x) {
        const VectorXd full = reduction.expand(x);
        model_.multiply(full, whole);
        if (anchor.weights) whole += anchor.weights->cwiseProduct(full);
        if (unsymmetric_) model_.remainder().add_product(full, true, whole);
        VectorXd image = reduction.vector(whole);
        reduction.add_curvature_product(forces, x, image);
        return VectorXd(scale.cwiseProduct(image));
    };
    const auto precondition = [&](VectorXd& x) {
        x = x.cwiseQuotient(scale);
        nearby.solve(x);
    };
    VectorXd reduced = scale.cwiseProduct(reduction.vector(rhs));
    const GmresReport report =
        gmres(assembled, precondition, reduced, {nearby_gradient_tolerance, nearby_gradient_vectors});
    if (report.converged) rhs = reduction.expand(reduced);
    return report;
}

VectorXd Newton::solve_with_factor(const VectorXd& rhs, double tolerance) const {
    const Stopwatch running(linear_time_);
    VectorXd reduced = model_.reduction().vector(rhs);
    if (unsymmetric_)
        solve_unsymmetric(model_, *factor_, false, {tolerance, to_round_off.max_iterations}, reduced);
    else
        factor_->solve(reduced);
    return model_.reduction().expand(reduced);
}

VectorXd Newton::solve_transposed(const VectorXd& rhs) const {
    if (!unsymmetric_) return solve_with_factor(rhs);
    const Stopwatch running(linear_time_);
    VectorXd reduced = model_.reduction().vector(rhs);
    const GmresReport report = solve_unsymmetric(model_, *factor_, true, to_round_off, reduced);
    if (!report.converged)
        throw InvalidInput(
            "a linear solve with friction, water, pressure or the torque of a Ball stopped at a residual "
            "of " +
            std::to_string(report.residual));
    return model_.reduction().expand(reduced);
}

}  // namespace magshell
