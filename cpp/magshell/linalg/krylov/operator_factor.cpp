#include "magshell/linalg/krylov/operator_factor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <vector>

#include "magshell/core/errors.h"
#include "magshell/linalg/dense_decompositions.h"
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

// The outcome of Lanczos' method.
struct Count {
    Index below = 0;       // eigenvalues below the bound
    bool settled = false;  // whether the next one is known to lie above it
    double margin =
        0.0;  // [-] distance of the nearest one from the bound, over the size of the largest one, or over 1
};

// Returns whether Lanczos' method has missed no eigenvalue below `bound`, but with an estimated probability of 1e-3. From a start that is
// uniform on the sphere, the lowest of n eigenvalues is below the lowest Ritz value after k steps by more than the part e of their
// spread with a probability below
//
//   1.648 sqrt(n) exp(-(2 k - 1) sqrt(e))                      [Kuczynski92]
//
// The start here is uniform in each unknown. Ritz values at both ends that are known take a step each, and the others have a smaller
// spread. An error of a Ritz value is `length` times the last component of its vector.
bool missed_none(const SymmetricEigen& ritz, double length, Index below, double bound, Index n) {
    // [-] Probability, and the constant of its bound; fixed by test_a_strip_beyond_its_buckling_load_is_not_called_stable.
    constexpr double probability = 1e-3, constant = 1.648;
    // [-] Error of a Ritz value, over its distance from the bound; see test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr double certain = 0.1;
    const Index steps = static_cast<Index>(ritz.values.size());
    const double needed = std::log(constant * std::sqrt(double(n)) / probability);
    const auto is_certain = [&](Index k) {
        return length * std::abs(ritz.vectors(steps - 1, k)) <= certain * std::abs(ritz.values[k] - bound);
    };
    for (Index low = below; low < steps; ++low) {
        if (low > below && !is_certain(low - 1)) return false;
        for (Index high = 0; low + high < steps && (high == 0 || is_certain(steps - high)); ++high) {
            const double part = (ritz.values[low] - bound) / (ritz.values[steps - 1 - high] - bound);
            if (double(2 * (steps - low - high) - 1) * std::sqrt(part) >= needed) return true;
        }
    }
    return false;
}

// Counts the eigenvalues of A^-1 H below `bound` by Lanczos' method in the inner product of A, with full orthogonalization. Vectors v and
// images z = A v are stored, so that products with A are not needed. diagonal: of A, so that unknowns of all units take part in the start.
Count count_below(const Factor& positive, const VectorXd& diagonal, const OperatorFactor::Operator& product,
                  double bound) {
    // Steps at least and at most; fixed by test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr int fewest = 6, most = 200;
    // [-] Length of a new vector, over the largest entry, at which the vectors span an invariant subspace; fixed by
    // test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr double negligible = 1e-12;
    const Index n = positive.size();
    VectorXd z(n);
    std::uint64_t state = 88172645463325252ull;
    for (Index k = 0; k < n; ++k) {  // pseudo-random, the same in every run
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        z[k] = std::sqrt(std::abs(diagonal[k])) * (static_cast<double>(state >> 11) * 0x1p-53 - 0.5);
    }
    std::vector<VectorXd> images, vectors;
    std::vector<double> products, beside;
    VectorXd v = z;
    positive.solve(v);
    double length = std::sqrt(std::max(0.0, z.dot(v))), largest = 0.0;
    Count count{.settled = n == 0};
    for (int step = 1; step <= std::min<Index>(most, n) && !count.settled; ++step) {
        images.push_back(z / length);
        vectors.push_back(v / length);
        z = product(vectors.back());
        if (!z.allFinite()) return {};
        products.push_back(z.dot(vectors.back()));
        for (int sweep = 0; sweep < 2; ++sweep)
            for (std::size_t k = vectors.size(); k-- > 0;) z -= z.dot(vectors[k]) * images[k];
        v = z;
        positive.solve(v);
        length = std::sqrt(std::max(0.0, z.dot(v)));
        largest = std::max({largest, std::abs(products.back()), length});
        const bool invariant = length <= negligible * largest || step == n;
        if (step >= fewest || invariant) {
            const Index size = static_cast<Index>(step);
            const SymmetricEigen ritz =
                eigen_of_tridiagonal(Eigen::Map<const VectorXd>(products.data(), size),
                                     Eigen::Map<const VectorXd>(beside.data(), size - 1));
            count.below = 0;
            while (count.below < size && ritz.values[count.below] < bound) ++count.below;
            count.settled = invariant || missed_none(ritz, length, count.below, bound, n);
            const double size_of_all =
                std::max({1.0, std::abs(ritz.values[0]), std::abs(ritz.values[size - 1])});
            count.margin = (ritz.values.array() - bound).abs().minCoeff() / size_of_all;
        }
        beside.push_back(length);
    }
    return count;
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
    Count count;
    VectorXd diagonal(size());
    for (Index j = 0; j < size(); ++j) diagonal[j] = entries_[pattern_->column_starts[j]];
    if (report_.negative_pivots == 0 && report_.perturbed_pivots == 0) {
        count = count_below(*sparse_, diagonal, rough_, -1.0);
        if (!count.settled || count.margin < clear_margin)
            count = count_below(*sparse_, diagonal, Operator(operator_), -1.0);
    } else {
        VectorXd shift;
        // K x = 0 means (A + D)^-1 (H - D) x = - x, with the shift D.
        if (const std::unique_ptr<Factor> positive = shifted(entries_, shift))
            count = count_below(
                *positive, diagonal,
                [&](const VectorXd& x) { return VectorXd(operator_(x) - shift.cwiseProduct(x)); }, -1.0);
    }
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
