#include "magshell/linalg/krylov/gmres.h"

#include <cmath>
#include <vector>

namespace magshell {
namespace {

// The least-squares problem of the Hessenberg matrix, solved by Givens rotations column by column.
class HessenbergLeastSquares {
  public:
    explicit HessenbergLeastSquares(double rhs_norm) : rhs_{rhs_norm} {}

    /// Adds column k, which has k + 2 entries.
    void add(std::vector<double> column) {
        const std::size_t k = columns_.size();
        for (std::size_t i = 0; i < k; ++i) {
            const double upper = column[i];
            column[i] = cosines_[i] * upper + sines_[i] * column[i + 1];
            column[i + 1] = -sines_[i] * upper + cosines_[i] * column[i + 1];
        }
        const double length = std::hypot(column[k], column[k + 1]);
        cosines_.push_back(length > 0.0 ? column[k] / length : 1.0);
        sines_.push_back(length > 0.0 ? column[k + 1] / length : 0.0);
        column[k] = length;
        rhs_.push_back(-sines_[k] * rhs_[k]);
        rhs_[k] *= cosines_[k];
        columns_.push_back(std::move(column));
    }

    double residual() const { return std::abs(rhs_.back()); }

    std::vector<double> solution() const {
        std::vector<double> y(columns_.size());
        for (std::size_t i = columns_.size(); i-- > 0;) {
            y[i] = rhs_[i];
            for (std::size_t j = i + 1; j < columns_.size(); ++j) y[i] -= columns_[j][i] * y[j];
            y[i] = columns_[i][i] != 0.0 ? y[i] / columns_[i][i] : 0.0;
        }
        return y;
    }

  private:
    std::vector<std::vector<double>> columns_;
    std::vector<double> rhs_, cosines_, sines_;
};

}  // namespace

GmresReport gmres(const std::function<VectorXd(const VectorXd&)>& product,
                  const std::function<void(VectorXd&)>& precondition, VectorXd& rhs,
                  const GmresOptions& options) {
    GmresReport report;
    const double norm = rhs.norm();
    if (norm == 0.0) {
        report.converged = true;
        return report;
    }
    std::vector<VectorXd> basis = {rhs / norm}, preconditioned;
    HessenbergLeastSquares small(norm);
    for (; report.iterations < options.max_iterations && !report.converged; ++report.iterations) {
        precondition(preconditioned.emplace_back(basis.back()));
        VectorXd next = product(preconditioned.back());
        std::vector<double> column(basis.size() + 1, 0.0);
        // Orthogonalizes twice: once leaves the basis orthogonal only to the square root of round-off.
        for (int sweep = 0; sweep < 2; ++sweep)
            for (std::size_t i = 0; i < basis.size(); ++i) {
                const double share = basis[i].dot(next);
                column[i] += share;
                next -= share * basis[i];
            }
        const double length = next.norm();
        column.back() = length;
        small.add(std::move(column));
        report.residual = small.residual() / norm;
        if (!std::isfinite(report.residual)) return report;
        report.converged = report.residual <= options.tolerance || length == 0.0;
        basis.push_back(length > 0.0 ? VectorXd(next / length) : next);
    }
    const std::vector<double> shares = small.solution();
    rhs.setZero();
    for (std::size_t i = 0; i < shares.size(); ++i) rhs += shares[i] * preconditioned[i];
    return report;
}

}  // namespace magshell
