#include "magshell/solve/modes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/linalg/dense_decompositions.h"

namespace magshell {
using Eigen::MatrixXd;

MatrixXd generic_vectors(Index rows, Index columns) {
    constexpr double two_to_53 = 9007199254740992.0;  // the number of doubles in [0.5, 1); plain-words: ok
    MatrixXd start(rows, columns);
    std::uint64_t state = 88172645463325252ull;
    for (int c = 0; c < columns; ++c)
        for (Index r = 0; r < rows; ++r) {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            start(r, c) = static_cast<double>(state >> 11) / two_to_53 - 0.5;
        }
    return start;
}

std::vector<Mode> modes_near_zero(Newton& newton, int count) {
    const Model& model = newton.model();
    const DofMap& dof_map = model.dof_map();
    const VectorXd metric = dof_map.weights(model.metric());
    // With reduced coordinates the metric is not diagonal.
    const auto weighed = [&](const MatrixXd& x) -> MatrixXd {
        if (!dof_map.has_reduced_coordinates()) return metric.asDiagonal() * x;
        MatrixXd product(x.rows(), x.cols());
        for (Index c = 0; c < x.cols(); ++c)
            product.col(c) = dof_map.vector(model.metric().cwiseProduct(dof_map.expand(x.col(c))));
        return product;
    };
    const Index massive = static_cast<Index>((metric.array() > 0.0).count());
    const int columns = std::min(count + 3, massive);

    // X = K^-1 M Y satisfies X^T K X = X^T M Y, so K itself is not needed. X = Q R is made orthonormal in M first, because near a
    // critical point all of its columns are almost the same.
    const VectorXd root = (dof_map.has_reduced_coordinates() ? model.metric() : metric).cwiseSqrt();
    const auto scaled = [&](const MatrixXd& x) -> MatrixXd {
        if (!dof_map.has_reduced_coordinates()) return root.asDiagonal() * x;
        MatrixXd product(root.size(), x.cols());
        for (Index c = 0; c < x.cols(); ++c) product.col(c) = root.cwiseProduct(dof_map.expand(x.col(c)));
        return product;
    };
    MatrixXd y = generic_vectors(dof_map.size(), columns);
    VectorXd eigenvalues = VectorXd::Zero(columns);
    // [-] Relative change of the eigenvalue nearest to zero at convergence; see test_the_modes_solve_the_problem.
    constexpr double eigenvalue_change = 1e-7;
    for (int round = 0; round < 40; ++round) {
        MatrixXd my = weighed(y), x = my;
        newton.factor()->solve(x);
        const MatrixXd r = triangle_of_qr(scaled(x));
        r.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(x);
        r.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(my);
        const MatrixXd k = x.transpose() * my;
        const SymmetricEigen ritz = eigen_of_symmetric(0.5 * (k + k.transpose()));
        const VectorXd before = eigenvalues;
        eigenvalues = ritz.values;
        y = x * ritz.vectors;
        const double scale = eigenvalues.cwiseAbs().minCoeff();
        Index nearest, nearest_before;
        eigenvalues.cwiseAbs().minCoeff(&nearest);
        before.cwiseAbs().minCoeff(&nearest_before);
        if (round > 2 && std::abs(eigenvalues[nearest] - before[nearest_before]) <= eigenvalue_change * scale)
            break;
    }
    std::vector<int> order(columns);
    for (int c = 0; c < columns; ++c) order[c] = c;
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(eigenvalues[a]) < std::abs(eigenvalues[b]); });
    order.resize(std::min(count, columns));
    std::sort(order.begin(), order.end());  // Ritz values ascend
    std::vector<Mode> modes;
    for (const int c : order) {
        VectorXd shape = dof_map.expand(y.col(c));
        Index largest;
        shape.head(model.n_coordinates()).cwiseAbs().maxCoeff(&largest);
        modes.push_back({eigenvalues[c], shape / shape[largest]});
    }
    return modes;
}

std::vector<Mode> most_unstable_modes(Newton& newton, const VectorXd& q,
                                      const LoadParameters& load_parameters, Index negative_pivots) {
    // Modes computed at most, and beyond the number of negative pivots; see test_all_unstable_directions_are_counted.
    constexpr Index most = 12, spare = 6;
    const int count = std::min(negative_pivots, most) + spare;
    std::vector<Mode> modes = modes_near_zero(newton, count);
    if (modes.front().eigenvalue < 0.0 || negative_pivots == 0) {
        if (modes.size() > 2) modes.resize(2);
        return modes;
    }

    // Many stable modes have eigenvalues nearer to zero. A shift makes all of them positive; the most unstable mode is then the nearest.
    double shift = std::max(std::abs(modes.front().eigenvalue), std::abs(modes.back().eigenvalue));
    Eigen::MatrixXd no_moves(q.size(), 0);
    for (FactorReport factor; !factor.succeeded || factor.negative_pivots > 0;) {
        shift *= 4.0;
        if (!std::isfinite(shift)) return {modes.front()};
        const VectorXd weights = shift * newton.model().metric();
        factor = newton.factorize(q, load_parameters, false, {&weights, &q}, no_moves);
    }
    Mode mode = modes_near_zero(newton, 1).front();
    mode.eigenvalue -= shift;
    return {std::move(mode)};
}

}  // namespace magshell
