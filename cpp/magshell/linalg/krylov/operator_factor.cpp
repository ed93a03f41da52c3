#include "magshell/linalg/krylov/operator_factor.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "magshell/core/errors.h"
#include "magshell/linalg/krylov/eigenvalue_count.h"
#include "magshell/linalg/krylov/gmres.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

// [-] Residual of solves relative to the right-hand side, and the largest one that is accepted; fixed by
// test_operator_factor_solves_and_counts_as_the_dense_matrix.
constexpr double tight = 1e-13, acceptable = 1e-9;
constexpr int most_iterations = 300;  // see test_operator_factor_solves_and_counts_as_the_dense_matrix
// [-] Tolerance of a solve above which a product with A right after a solve with A is taken for the identity; fixed by
// test_operator_factor_solves_and_counts_as_the_dense_matrix.
constexpr double rounding_matters = 1e-10;

// [-] Tolerance of a solve from which on rough products suffice; see test_solves_with_a_large_tolerance_take_rough_products.
constexpr double rough_suffices = 1e-5;
// [-] Distance of the nearest eigenvalue from the bound, over the largest one, from which on a count with rough products is sure: ten times
// the error of these; see test_solves_with_a_large_tolerance_take_rough_products.
constexpr double clear_margin = 1e-2;

std::function<void(VectorXd&)> solves_with(const Factor& factor) {
    return [&factor](VectorXd& x) { factor.solve(x); };
}

}  // namespace

OperatorFactor::OperatorFactor(std::unique_ptr<Factor> sparse)
    : Factor(sparse->pattern()), sparse_(std::move(sparse)) {}

std::unique_ptr<Factor> OperatorFactor::shifted(const LargeVector<double>& values, VectorXd& shift) const {
    // [-] Parts of the diagonal that are tried, each ten times the last; see
    // test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr double first = 1e-7, factor = 10.0, last = 10.0;
    shift.resize(size());
    std::unique_ptr<Factor> positive = sparse_->sibling();
    for (double part = first; part <= last; part *= factor) {
        LargeVector<double>& entries = positive->values();
        std::copy(values.begin(), values.end(), entries.begin());
        for (Index j = 0; j < size(); ++j) {
            double& own = entries[pattern_->column_starts[j]];
            shift[j] = part * std::abs(own);
            own += shift[j];
        }
        const FactorReport report = positive->factorize();
        if (report.succeeded && report.negative_pivots == 0 && report.perturbed_pivots == 0) return positive;
    }
    return nullptr;
}

FactorReport OperatorFactor::factorize() {
    if (operator_) entries_ = values_;
    std::swap(sparse_->values(), values_);
    report_ = sparse_->factorize();
    counted_ = !report_.succeeded || !operator_;
    return deferred_ ? report_ : complete_report();
}

FactorReport OperatorFactor::complete_report() {
    if (counted_) return report_;
    counted_ = true;
    EigenvalueCount count;
    VectorXd diagonal(size());
    for (Index j = 0; j < size(); ++j) diagonal[j] = entries_[pattern_->column_starts[j]];
    if (report_.negative_pivots == 0 && report_.perturbed_pivots == 0) {
        count = count_below(solves_with(*sparse_), diagonal, rough_, -1.0);
        if (!count.settled || count.margin < clear_margin)
            count = count_below(solves_with(*sparse_), diagonal, Operator(operator_), -1.0);
    } else {
        VectorXd shift;
        // K x = 0 means (A + D)^-1 (H - D) x = - x, with the shift D.
        if (const std::unique_ptr<Factor> positive = shifted(entries_, shift))
            count = count_below(
                solves_with(*positive), diagonal,
                [&](const VectorXd& x) { return VectorXd(operator_(x) - shift.cwiseProduct(x)); }, -1.0);
    }
    count_bytes_ = std::max(count_bytes_, count.bytes);
    // Without a settled count K may be indefinite, so it is not called stable.
    report_.negative_pivots = count.settled ? count.below : std::max<Index>(count.below, 1);
    report_.perturbed_pivots = count.settled ? 0 : 1;
    return report_;
}

VectorXd OperatorFactor::image(const VectorXd& x) const {
    VectorXd out = sparse_->image(x);
    if (operator_) out += operator_(x);
    return out;
}

void OperatorFactor::solve_approximately(VectorXd& rhs, double tolerance) const {
    if (!operator_) return sparse_->solve(rhs);
    const bool identity = tolerance > rounding_matters;
    const auto added = [&](const VectorXd& x) {
        return tolerance >= rough_suffices ? rough_(x) : operator_(x);
    };
    VectorXd before;
    const auto product = [&](const VectorXd& x) {
        return VectorXd((identity ? before : sparse_->image(x)) + added(x));
    };
    const auto precondition = [&](VectorXd& x) {
        if (identity) before = x;
        sparse_->solve(x);
    };
    const GmresReport report = gmres(product, precondition, rhs, {tolerance, most_iterations});
    if (!report.converged && !(report.residual <= std::max(tolerance, acceptable))) {
        if (!std::isfinite(report.residual))
            throw InvalidInput(
                "the forces of the own field are not finite: bodies touch or pass through each other. "
                "Nothing but a "
                "contact keeps bodies apart that attract each other");
        std::ostringstream message;
        message << "a linear solve with the own field did not converge: its relative residual is "
                << report.residual << " after " << report.iterations << " iterations";
        throw InvalidInput(message.str());
    }
}

void OperatorFactor::solve(Eigen::Ref<Eigen::MatrixXd> rhs) const {
    check_solvable(report_, size(), rhs);
    for (Eigen::Index c = 0; c < rhs.cols(); ++c) {
        VectorXd column = rhs.col(c);
        solve_approximately(column, tight);
        rhs.col(c) = column;
    }
}

std::unique_ptr<Factor> OperatorFactor::sibling() const {
    return std::make_unique<OperatorFactor>(sparse_->sibling());
}

}  // namespace magshell
