#include "magshell/solve/modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

using Eigen::MatrixXd;

// A start that no symmetry of the sheet is likely to be orthogonal to, the same on every run.
MatrixXd generic_start(Index rows, int columns) {
    MatrixXd start(rows, columns);
    std::uint64_t state = 88172645463325252ull;
    for (int c = 0; c < columns; ++c)
        for (Index r = 0; r < rows; ++r) {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            start(r, c) = static_cast<double>(state >> 11) / 9007199254740992.0 - 0.5;
        }
    return start;
}

}  // namespace

std::vector<Mode> modes_near_zero(Newton& newton, int count) {
    const Model& model = newton.model();
    const Reduction& reduction = model.reduction();
    const VectorXd metric = reduction.weights(model.metric());
    // With carriers it is no diagonal.
    const auto weighed = [&](const MatrixXd& x) -> MatrixXd {
        if (!reduction.carries()) return metric.asDiagonal() * x;
        MatrixXd product(x.rows(), x.cols());
        for (Index c = 0; c < x.cols(); ++c)
            product.col(c) = reduction.vector(model.metric().cwiseProduct(reduction.expand(x.col(c))));
        return product;
    };
    const Index massive = static_cast<Index>((metric.array() > 0.0).count());
    const int columns = std::min(count + 3, massive);

    // With X = K^-1 M Y: X^T K X = X^T M Y, so K itself is not needed. X = Q R is made orthonormal in M
    // first: next to a critical point all its columns are almost the same.
    const VectorXd root = (reduction.carries() ? model.metric() : metric).cwiseSqrt();
    const auto scaled = [&](const MatrixXd& x) -> MatrixXd {
        if (!reduction.carries()) return root.asDiagonal() * x;
        MatrixXd product(root.size(), x.cols());
        for (Index c = 0; c < x.cols(); ++c) product.col(c) = root.cwiseProduct(reduction.expand(x.col(c)));
        return product;
    };
    MatrixXd y = generic_start(reduction.size(), columns);
    VectorXd eigenvalues = VectorXd::Zero(columns);
    for (int round = 0; round < 40; ++round) {
        MatrixXd my = weighed(y), x = my;
        newton.factor()->solve(x);
        const Eigen::HouseholderQR<MatrixXd> qr(scaled(x));
        const MatrixXd r = qr.matrixQR().topRows(columns);
        r.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(x);
        r.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(my);
        const MatrixXd k = x.transpose() * my;
        const Eigen::SelfAdjointEigenSolver<MatrixXd> ritz(0.5 * (k + k.transpose()));
        const VectorXd before = eigenvalues;
        eigenvalues = ritz.eigenvalues();
        y = x * ritz.eigenvectors();
        const double scale = eigenvalues.cwiseAbs().minCoeff();
        Index nearest, nearest_before;
        eigenvalues.cwiseAbs().minCoeff(&nearest);
        before.cwiseAbs().minCoeff(&nearest_before);
        if (round > 2 && std::abs(eigenvalues[nearest] - before[nearest_before]) <= 1e-7 * scale) break;
    }
    std::vector<int> order(columns);
    for (int c = 0; c < columns; ++c) order[c] = c;
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(eigenvalues[a]) < std::abs(eigenvalues[b]); });
    order.resize(std::min(count, columns));
    std::sort(order.begin(), order.end());  // Ritz values ascend
    std::vector<Mode> modes;
    for (const int c : order) {
        VectorXd shape = reduction.expand(y.col(c));
        Index largest;
        shape.head(model.n_coordinates()).cwiseAbs().maxCoeff(&largest);
        modes.push_back({eigenvalues[c], shape / shape[largest]});
    }
    return modes;
}

Mode most_unstable_mode(Newton& newton, const VectorXd& q, const Controls& controls, Index negative_pivots) {
    constexpr Index most = 12, spare = 6;
    const int count = std::min(negative_pivots, most) + spare;
    std::vector<Mode> modes = modes_near_zero(newton, count);
    if (modes.front().eigenvalue < 0.0 || negative_pivots == 0) return modes.front();

    // Many stable modes lie nearer to zero. Shift until all are stable; the most unstable one is then the nearest.
    double shift = std::max(std::abs(modes.front().eigenvalue), std::abs(modes.back().eigenvalue));
    Eigen::MatrixXd no_moves(q.size(), 0);
    for (FactorReport factor; !factor.succeeded || factor.negative_pivots > 0;) {
        shift *= 4.0;
        if (!std::isfinite(shift)) return modes.front();
        const VectorXd weights = shift * newton.model().metric();
        factor = newton.factorize(q, controls, false, {&weights, &q}, no_moves);
    }
    Mode mode = modes_near_zero(newton, 1).front();
    mode.eigenvalue -= shift;
    return mode;
}

}  // namespace magshell
