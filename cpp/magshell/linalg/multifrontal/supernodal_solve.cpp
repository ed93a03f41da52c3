// Solution with SupernodalLdlt: scaling, substitution, and iterative refinement where the factorization was not
// exact.
#include <algorithm>
#include <cmath>

#include "magshell/linalg/multifrontal/supernodal_ldlt.h"
#include "magshell/linalg/multifrontal/triangular_solves.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

// [-] pivot growth from which solutions are refined: below it they have at least 12 digits; fixed by
// test_pivot_growth_distinguishes_definite_from_ill_conditioned
constexpr double refined_from_growth = 1e4;
constexpr int most_refinements = 8;  // [-] fixed by test_a_singular_matrix_is_reported
// [-] relative residual of a refined solution; test_a_saddle_point_with_a_small_corner_is_solved
constexpr double rounding = 1e-15;
// [-] Largest relative error of the recovered vector; fixed by test_a_singular_matrix_is_reported
constexpr double recovered = 1e-3;

}  // namespace

void SupernodalLdlt::solve_factored(Eigen::Ref<Eigen::MatrixXd> rhs) const {
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
    if (report_.perturbed_pivots == 0 && report_.pivot_growth < refined_from_growth)
        return solve_factored(rhs);
    for (Index j = 0; j < rhs.cols(); ++j) rhs.col(j) = refined_solution(rhs.col(j));
}

// Returns A x. S consists of powers of two, so nothing is lost by removing it.
VectorXd SupernodalLdlt::image(const VectorXd& x) const {
    const Eigen::Map<const VectorXd> scale(scale_.data(), size());
    return product(*pattern_, values_.data(), x.cwiseQuotient(scale)).cwiseQuotient(scale);
}

// Refines x += (L D L^T)^-1 (b - A x) until the residual is down to round-off or stops falling.
VectorXd SupernodalLdlt::refined_solution(const VectorXd& rhs) const {
    // Norms are those of the scaled unknowns, where rows are comparable.
    const auto residual_norm = [&](const VectorXd& residual) {
        double largest = 0.0;
        for (Index j = 0; j < size(); ++j) largest = std::max(largest, std::abs(residual[j] * scale_[j]));
        return largest;
    };
    const auto solution_norm = [&](const VectorXd& solution) {
        double largest = 0.0;
        for (Index j = 0; j < size(); ++j) largest = std::max(largest, std::abs(solution[j] / scale_[j]));
        return largest;
    };
    VectorXd solution = rhs;
    solve_factored(solution);
    VectorXd residual = rhs - image(solution);
    double norm = residual_norm(residual);
    for (int step = 0; step < most_refinements; ++step) {
        if (norm <= rounding * (largest_scaled_ * solution_norm(solution) + residual_norm(rhs))) break;
        VectorXd candidate = residual;
        solve_factored(candidate);
        candidate += solution;
        residual = rhs - image(candidate);
        const double candidate_norm = residual_norm(residual);
        if (!(candidate_norm < norm)) break;
        std::swap(solution, candidate);
        norm = candidate_norm;
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
