#include "magshell/linalg/krylov/eigenvalue_count.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "magshell/linalg/dense_decompositions.h"

namespace magshell {
namespace {

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

}  // namespace

// Vectors v and images z = A v are stored, so that products with A are not needed.
EigenvalueCount count_below(const std::function<void(VectorXd&)>& solve, const VectorXd& diagonal,
                            const std::function<VectorXd(const VectorXd&)>& product, double bound,
                            bool with_directions) {
    // Steps at least and at most; fixed by test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr int fewest = 6, most = 200;
    // [-] Length of a new vector, over the largest entry, at which the vectors span an invariant subspace; fixed by
    // test_operator_factor_solves_and_counts_as_the_dense_matrix.
    constexpr double negligible = 1e-12;
    const Index n = diagonal.size();
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
    solve(v);
    double length = std::sqrt(std::max(0.0, z.dot(v))), largest = 0.0;
    EigenvalueCount count{.settled = n == 0};
    for (int step = 1; step <= std::min<Index>(most, n) && !count.settled; ++step) {
        images.push_back(z / length);
        vectors.push_back(v / length);
        z = product(vectors.back());
        if (!z.allFinite()) return {};
        products.push_back(z.dot(vectors.back()));
        for (int sweep = 0; sweep < 2; ++sweep)
            for (std::size_t k = vectors.size(); k-- > 0;) z -= z.dot(vectors[k]) * images[k];
        v = z;
        solve(v);
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
            if (with_directions && count.settled) {
                count.directions = Eigen::MatrixXd::Zero(n, count.below);
                for (Index k = 0; k < count.below; ++k)
                    for (Index j = 0; j < size; ++j)
                        count.directions.col(k) += ritz.vectors(j, k) * vectors[static_cast<std::size_t>(j)];
            }
            count.margin = (ritz.values.array() - bound).abs().minCoeff() / size_of_all;
        }
        beside.push_back(length);
    }
    count.bytes = 2 * vectors.size() * static_cast<std::size_t>(n) * sizeof(double);
    return count;
}

}  // namespace magshell
