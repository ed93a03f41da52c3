#include "magshell/linalg/low_rank_factor.h"

#include <cmath>
#include <limits>
#include <utility>

#include "magshell/linalg/dense_decompositions.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

// [-] Magnitude below which an eigenvalue of the scaled border counts as zero, so that K is singular; fixed by
// test_solutions_and_inertia.
constexpr double singular = 16.0 * std::numeric_limits<double>::epsilon();
// [-] Ratio of the solution of A alone to that of K above which the latter is refined: A is nearly singular
// where a pressure reaches its limit. Fixed by test_a_sparse_part_that_is_next_to_singular_alone.
constexpr double cancelling = 30.0;
// [-] Largest number of refinements; fixed by test_a_sparse_part_that_is_next_to_singular_alone
constexpr int most_refinements = 4;

}  // namespace

LowRankFactor::LowRankFactor(std::unique_ptr<Factor> sparse)
    : Factor(sparse->pattern()), sparse_(std::move(sparse)), columns_(size(), 0) {}

void LowRankFactor::set_low_rank(Eigen::MatrixXd columns, const VectorXd& stiffness) {
    columns_ = std::move(columns);
    for (Index k = 0; k < columns_.cols(); ++k) columns_.col(k) *= std::sqrt(std::abs(stiffness[k]));
    signs_ = stiffness.unaryExpr([](double each) { return each < 0.0 ? -1.0 : 1.0; });
}

FactorReport LowRankFactor::factorize() {
    std::swap(sparse_->values(), values_);
    report_ = sparse_->factorize();
    if (!report_.succeeded || columns_.cols() == 0) return report_;
    solved_ = columns_;
    sparse_->solve(solved_);
    Eigen::MatrixXd m = columns_.transpose() * solved_;
    m = 0.5 * (m + m.transpose()).eval();
    m.diagonal() += signs_;
    // Scales each row by its diagonal, because the columns have very different stiffnesses.
    const VectorXd scale =
        m.diagonal().unaryExpr([](double each) { return 1.0 / std::sqrt(1.0 + std::abs(each)); });
    m = scale.asDiagonal() * m * scale.asDiagonal();
    if (!m.allFinite()) {
        report_.succeeded = false;
        report_.reason = "the stiffness is singular without what its cavities and tendons add";
        return report_;
    }
    const SymmetricEigen parts = eigen_of_symmetric(m);
    VectorXd inverse = parts.values;
    for (Index k = 0; k < inverse.size(); ++k) {
        if (std::abs(inverse[k]) < singular) {
            ++report_.perturbed_pivots;
            inverse[k] = std::copysign(singular, inverse[k]);
        }
        report_.negative_pivots += inverse[k] > 0.0;
        report_.negative_pivots -= signs_[k] > 0.0;
        inverse[k] = 1.0 / inverse[k];
    }
    border_ = scale.asDiagonal() * parts.vectors * inverse.asDiagonal() * parts.vectors.transpose() *
              scale.asDiagonal();
    return report_;
}

VectorXd LowRankFactor::image(const VectorXd& x) const {
    VectorXd out = sparse_->image(x);
    if (columns_.cols() > 0) out += columns_ * signs_.cwiseProduct(columns_.transpose() * x);
    return out;
}

void LowRankFactor::solve_once(Eigen::Ref<Eigen::MatrixXd> rhs) const {
    sparse_->solve(rhs);
    const Eigen::MatrixXd along = border_ * (columns_.transpose() * rhs);
    rhs -= solved_ * along;
}

void LowRankFactor::solve(Eigen::Ref<Eigen::MatrixXd> rhs) const {
    check_solvable(report_, size(), rhs);
    if (columns_.cols() == 0) return sparse_->solve(rhs);
    const Eigen::MatrixXd given = rhs;
    sparse_->solve(rhs);
    const VectorXd before = rhs.colwise().norm();
    const Eigen::MatrixXd along = border_ * (columns_.transpose() * rhs);
    rhs -= solved_ * along;
    for (Index c = 0; c < rhs.cols(); ++c) {
        if (before[c] <= cancelling * rhs.col(c).norm()) continue;
        VectorXd rest = given.col(c) - image(rhs.col(c));
        for (int step = 0; step < most_refinements; ++step) {
            VectorXd candidate = rest;
            solve_once(candidate);
            candidate += rhs.col(c);
            const VectorXd left = given.col(c) - image(candidate);
            if (!(left.norm() < 0.5 * rest.norm())) break;
            rhs.col(c) = candidate;
            rest = left;
        }
    }
}

std::unique_ptr<Factor> LowRankFactor::sibling() const {
    std::unique_ptr<LowRankFactor> other = std::make_unique<LowRankFactor>(sparse_->sibling());
    other->columns_ = columns_;
    other->signs_ = signs_;
    return other;
}

double LowRankFactor::flops() const {
    const double k = static_cast<double>(columns_.cols());
    return sparse_->flops() + 4.0 * k * static_cast<double>(sparse_->nonzeros()) + 2.0 * k * k * size();
}

}  // namespace magshell
