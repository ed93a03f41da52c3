// Solution with SupernodalLdlt: scaling, substitution, and iterative refinement where pivots were delayed.
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/linalg/multifrontal/supernodal_ldlt.h"
#include "magshell/linalg/multifrontal/triangular_solves.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

constexpr int most_refinements = 8;  // [-] fixed by test_a_singular_matrix_is_reported
// [-] componentwise backward error of a refined solution
constexpr double rounding = std::numeric_limits<double>::epsilon();
// [-] Largest relative error of the recovered vector; fixed by test_a_singular_matrix_is_reported
constexpr double recovered = 1e-3;

// Returns the componentwise backward error of x: the smallest relative change of the entries of A and b for
// which x is exact (Oettli and Prager 1964). Where a row of |A| |x| + |b| is no larger than its own round-off,
// it is replaced by a norm, as Arioli, Demmel and Duff (1989) do.
double backward_error(const SparsePattern& pattern, const double* values, const VectorXd& x,
                      const VectorXd& rhs, const VectorXd& residual) {
    VectorXd terms = rhs.cwiseAbs(), row_sums = VectorXd::Zero(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index i = pattern.rows[k];
            const double entry = std::abs(values[k]);
            terms[i] += entry * std::abs(x[j]);
            row_sums[i] += entry;
            if (i == j) continue;
            terms[j] += entry * std::abs(x[i]);
            row_sums[j] += entry;
        }
    }
    const double largest = x.lpNorm<Eigen::Infinity>();
    constexpr double cancelled =
        1000.0 * std::numeric_limits<double>::epsilon();  // Arioli et al.; plain-words: ok
    double error = 0.0;
    for (Index i = 0; i < pattern.size; ++i) {
        const double norm = row_sums[i] * largest;
        const double size =
            terms[i] > cancelled * pattern.size * (norm + std::abs(rhs[i])) ? terms[i] : terms[i] + norm;
        if (residual[i] != 0.0) error = std::max(error, std::abs(residual[i]) / size);
    }
    return error;
}

}  // namespace

void SupernodalLdlt::solve_factored(Eigen::Ref<Eigen::MatrixXd> rhs) const {
    if (delayed_) {
        VectorXd x(size());
        for (Index j = 0; j < rhs.cols(); ++j) {
            for (Index k = 0; k < size(); ++k) x[k] = rhs(plan_.order[k], j) * scale_[plan_.order[k]];
            delayed_->solve(x);
            for (Index k = 0; k < size(); ++k) rhs(plan_.order[k], j) = x[k] * scale_[plan_.order[k]];
        }
        return;
    }
    const FactorView view{plan_,
                          factor_.data(),
                          {const_cast<double*>(diagonal_.data()), const_cast<double*>(coupling_.data())},
                          pivot_order_.data()};
    const Index size = this->size();
    for (Index first = 0; first < rhs.cols();) {
        const Index count = std::min<Index>(slabs::width, static_cast<Index>(rhs.cols()) - first);
        const Index stride = count == 1 ? 1 : slabs::width;
        slabs::Buffer x(std::ptrdiff_t{stride} * size);
        for (Index k = 0; k < size; ++k) {
            const Index unknown = plan_.order[k];
            for (Index j = 0; j < count; ++j)
                x.data()[stride * k + j] = rhs(unknown, first + j) * scale_[unknown];
            std::fill(x.data() + stride * k + count, x.data() + stride * (k + 1), 0.0);
        }
        if (count == 1)
            substitute_one(view, x.data());
        else
            substitute_eight(view, x.data());
        for (Index k = 0; k < size; ++k) {
            const Index unknown = plan_.order[k];
            for (Index j = 0; j < count; ++j)
                rhs(unknown, first + j) = x.data()[stride * k + j] * scale_[unknown];
        }
        first += count;
    }
}

void SupernodalLdlt::solve(Eigen::Ref<Eigen::MatrixXd> rhs) const {
    check_solvable(report_, size(), rhs);
    if (!delayed_) return solve_factored(rhs);
    for (Index j = 0; j < rhs.cols(); ++j) rhs.col(j) = refined_solution(rhs.col(j));
}

// Returns A x. S consists of powers of two, so nothing is lost by removing it.
VectorXd SupernodalLdlt::image(const VectorXd& x) const {
    const Eigen::Map<const VectorXd> scale(scale_.data(), size());
    return product(*pattern_, values_.data(), x.cwiseQuotient(scale)).cwiseQuotient(scale);
}

// Refines x += (L D L^T)^-1 (b - A x) until the backward error is down to round-off or no longer halves. Sizes are
// those of the scaled unknowns, where rows are comparable.
VectorXd SupernodalLdlt::refined_solution(const VectorXd& rhs) const {
    const Eigen::Map<const VectorXd> scale(scale_.data(), size());
    const VectorXd scaled_rhs = rhs.cwiseProduct(scale);
    const auto error_of = [&](const VectorXd& solution, const VectorXd& residual) {
        return backward_error(*pattern_, values_.data(), solution.cwiseQuotient(scale), scaled_rhs,
                              residual.cwiseProduct(scale));
    };
    VectorXd solution = rhs;
    solve_factored(solution);
    VectorXd residual = rhs - image(solution);
    double error = error_of(solution, residual);
    for (int step = 0; step < most_refinements && error > rounding; ++step) {
        VectorXd candidate = residual;
        solve_factored(candidate);
        candidate += solution;
        residual = rhs - image(candidate);
        const double candidate_error = error_of(candidate, residual);
        if (!(candidate_error < error)) break;
        std::swap(solution, candidate);
        const bool halved = candidate_error <= 0.5 * error;
        error = candidate_error;
        if (!halved) break;
    }
    return solution;
}

// Checks that solving with the image of a known vector, of size one in the scaled unknowns, gives that vector
// back. Along a null direction it cannot, however small the residual.
bool SupernodalLdlt::recovers_known_solution() const {
    constexpr double half_range = 2147483648.0;  // 2^31, half of the range of the hash; plain-words: ok
    VectorXd known(size());
    for (Index j = 0; j < size(); ++j) {
        const std::uint32_t hash = static_cast<std::uint32_t>(j + 1) * 2654435769u;  // golden-ratio hashing
        known[j] = scale_[j] * (hash / half_range - 1.0);
    }
    const VectorXd found = refined_solution(image(known));
    for (Index j = 0; j < size(); ++j) {
        if (!(std::abs(found[j] - known[j]) <= recovered * scale_[j])) return false;
    }
    return true;
}

}  // namespace magshell
