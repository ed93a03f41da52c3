#include "magshell/solve/nonsymmetric_modes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/linalg/dense_decompositions.h"
#include "magshell/solve/modes.h"
#include "magshell/solve/newton/unsymmetric.h"

namespace magshell {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

// Vectors per block, so that double eigenvalues of symmetric scenes are found twice, and blocks at most; see
// test_stability_under_a_nonsymmetric_pressure.
constexpr Index block_size = 3, max_blocks = 40;
// [-] Residual of an eigenpair of the inverse, over its eigenvalue, at convergence, and that of the linear solves; see
// test_stability_under_a_nonsymmetric_pressure.
constexpr double converged_residual = 1e-6, solve_tolerance = 1e-10;

// x -> K^-1 M x in the reduced dofs.
class InverseTangent {
  public:
    InverseTangent(Newton& newton, bool transposed)
        : model_(newton.model()), factor_(*newton.factor()), transposed_(transposed) {}

    Index size() const { return model_.dof_map().size(); }
    bool exact() const { return exact_; }  // whether all solves have converged
    MatrixXd operator()(const MatrixXd& x) {
        const DofMap& dof_map = model_.dof_map();
        const GmresOptions options{solve_tolerance, to_round_off.max_iterations};
        MatrixXd image(x.rows(), x.cols());
        for (Index c = 0; c < x.cols(); ++c) {
            VectorXd y = dof_map.vector(model_.metric().cwiseProduct(dof_map.expand(x.col(c))));
            if (!solve_unsymmetric(model_, factor_, transposed_, options, y).converged) exact_ = false;
            image.col(c) = y;
        }
        return image;
    }

  private:
    const Model& model_;
    const Factor& factor_;
    const bool transposed_;
    bool exact_ = true;
};

// Returns an orthonormal basis of the columns, which are orthogonal to `basis` already up to round-off.
MatrixXd orthonormal(MatrixXd x, const MatrixXd& basis) {
    for (int pass = 0; pass < 2; ++pass) {
        x -= basis * (basis.transpose() * x);
        x = orthonormal_columns(x);
    }
    return x;
}

struct RitzPairs {
    Eigen::VectorXcd values;     // of the inverse
    MatrixXcd vectors;           // of the reduced dofs
    std::vector<bool> accurate;  // whether each has converged
    std::vector<int> order;      // from the largest absolute value on
};

RitzPairs ritz_pairs(const MatrixXd& basis, const MatrixXd& projected, const MatrixXd& next) {
    ComplexEigen eigen = eigen_of_real(projected);
    RitzPairs pairs{std::move(eigen.values), std::move(eigen.vectors), {}, {}};
    const Index n = projected.rows();
    for (Index k = 0; k < n; ++k) {
        const double residual =
            next.size() > 0 ? (next * pairs.vectors.col(k).tail(next.cols())).norm() : 0.0;
        pairs.accurate.push_back(residual <= converged_residual * std::abs(pairs.values[k]));
        pairs.order.push_back(static_cast<int>(k));
    }
    std::sort(pairs.order.begin(), pairs.order.end(),
              [&](int a, int b) { return std::abs(pairs.values[a]) > std::abs(pairs.values[b]); });
    pairs.vectors = basis.leftCols(n) * pairs.vectors;
    return pairs;
}

// Returns true if the largest eigenvalue of the inverse has converged, and all that are larger than the inverse of the radius.
bool covers(const RitzPairs& pairs, double radius) {
    for (std::size_t k = 0; k < pairs.order.size(); ++k) {
        if (k > 0 && std::abs(pairs.values[pairs.order[k]]) * radius < 1.0) return true;
        if (!pairs.accurate[pairs.order[k]]) return false;
    }
    return true;
}

NonsymmetricSpectrum spectrum_of(const RitzPairs& pairs, const Model& model, bool complete) {
    // [-] Eigenvalue of the inverse, over the largest, below which it is round-off: dofs without a metric have none.
    constexpr double round_off = 1e-12;  // see test_stability_under_a_nonsymmetric_pressure
    NonsymmetricSpectrum spectrum;
    spectrum.complete = complete;
    const double most = std::abs(pairs.values[pairs.order.front()]);
    for (const int k : pairs.order) {
        const std::complex<double> value = pairs.values[k];
        if (!pairs.accurate[k] || std::abs(value) <= round_off * most) continue;
        if (value.real() < 0.0) ++spectrum.unstable_directions;
        if (value.imag() > 0.0) continue;  // 1 / value has a negative imaginary part
        VectorXd shape = model.dof_map().expand(pairs.vectors.col(k).real());
        Index largest;
        shape.head(model.n_coordinates()).cwiseAbs().maxCoeff(&largest);
        shape /= shape[largest];
        spectrum.modes.push_back({1.0 / value, std::move(shape)});
    }
    return spectrum;
}

}  // namespace

NonsymmetricSpectrum spectrum_near_zero(Newton& newton, double radius, bool transposed) {
    const Model& model = newton.model();
    InverseTangent inverse(newton, transposed);
    const Index n = inverse.size();
    if (n <= block_size * max_blocks) {
        const RitzPairs all = ritz_pairs(MatrixXd::Identity(n, n), inverse(MatrixXd::Identity(n, n)), {});
        return spectrum_of(all, model, inverse.exact());
    }
    MatrixXd basis = orthonormal(inverse(generic_vectors(n, block_size)), MatrixXd(n, 0)), projected;
    for (Index blocks = 1;; ++blocks) {
        const Index width = basis.cols();
        const MatrixXd image = inverse(basis.rightCols(block_size));
        projected.conservativeResizeLike(MatrixXd::Zero(width, width));
        projected.rightCols(block_size) = basis.transpose() * image;
        const MatrixXd rest = image - basis * projected.rightCols(block_size);
        const MatrixXd added = orthonormal(rest, basis);
        const MatrixXd next = added.transpose() * image;
        const RitzPairs pairs = ritz_pairs(basis, projected, next);
        const bool complete = covers(pairs, radius);
        if (complete || blocks == max_blocks) return spectrum_of(pairs, model, complete && inverse.exact());
        projected.conservativeResizeLike(MatrixXd::Zero(width + block_size, width));
        projected.bottomRightCorner(block_size, block_size) = next;
        basis.conservativeResize(n, width + block_size);
        basis.rightCols(block_size) = added;
    }
}

Index count_unstable_directions(Newton& newton, const FactorReport& factor) {
    if (!factor.succeeded || factor.negative_pivots == 0 || !newton.is_unsymmetric())
        return factor.negative_pivots;
    // The lowest eigenvalue of the symmetric part bounds those of K. It is known once all negative ones are.
    constexpr int spare = 12;  // modes beyond them; see test_stability_under_a_nonsymmetric_pressure
    const std::vector<Mode> lowest =
        modes_near_zero(newton, static_cast<int>(factor.negative_pivots) + spare);
    const auto found =
        std::count_if(lowest.begin(), lowest.end(), [](const Mode& m) { return m.eigenvalue < 0.0; });
    if (found < factor.negative_pivots) return factor.negative_pivots;
    const NonsymmetricSpectrum spectrum = spectrum_near_zero(newton, std::abs(lowest.front().eigenvalue));
    return spectrum.complete ? spectrum.unstable_directions : factor.negative_pivots;
}

}  // namespace magshell
