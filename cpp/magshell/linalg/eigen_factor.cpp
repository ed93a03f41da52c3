// EigenFactor: Eigen's SimplicialLDLT, without supernodes and pivoting. It needs nothing but Eigen, and is the
// reference that the others are tested against, in builds with MAGSHELL_TESTING.
#include "magshell/linalg/backends.h"

#ifndef MAGSHELL_TESTING
#include "magshell/core/errors.h"

namespace magshell {

std::unique_ptr<Factor> make_eigen_factor(std::shared_ptr<const SparsePattern>) {
    throw InvalidInput("magshell was built without MAGSHELL_TESTING; use the backend \"supernodal\"");
}

}  // namespace magshell
#else
#include <Eigen/SparseCholesky>
#include <string>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

class EigenFactor : public Factor {
  public:
    explicit EigenFactor(std::shared_ptr<const SparsePattern> pattern) : Factor(std::move(pattern)) {
        const std::vector<double> values(pattern_->rows.size(), 1.0);
        if (pattern_->size > 0) solver_.analyzePattern(view(values.data()));
    }

    FactorReport factorize() override {
        check_finite(values_);
        report_ = {};
        report_.succeeded = true;
        if (pattern_->size == 0) return report_;
        solver_.factorize(view(values_.data()));
        if (solver_.info() != Eigen::Success) {
            report_.succeeded = false;
            report_.reason =
                "a pivot is exactly zero: the matrix is singular, or indefinite and needs pivoting";
            return report_;
        }
        const VectorXd pivots = solver_.vectorD();
        for (Index j = 0; j < pattern_->size; ++j) report_.negative_pivots += pivots[j] < 0.0;
        return report_;
    }

    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override {
        check_solvable(report_, pattern_->size, rhs);
        if (rhs.size() == 0) return;
        const Eigen::MatrixXd solution = solver_.solve(rhs);
        rhs = solution;
    }

    std::unique_ptr<Factor> sibling() const override { return std::make_unique<EigenFactor>(pattern_); }
    std::string name() const override { return "eigen"; }

    // Eigen knows neither of these before the first factorization.
    std::int64_t nonzeros() const override {
        return report_.succeeded && pattern_->size > 0
                   ? solver_.matrixL().nestedExpression().nonZeros() + pattern_->size
                   : 0;
    }
    double flops() const override {
        if (nonzeros() == 0) return 0.0;
        const auto* starts = solver_.matrixL().nestedExpression().outerIndexPtr();
        double sum = 0.0;
        for (Index j = 0; j < pattern_->size; ++j) {
            const double entries = starts[j + 1] - starts[j];
            sum += entries * (entries + 2.0);
        }
        return sum;
    }
    std::size_t bytes() const override {
        return static_cast<std::size_t>(nonzeros()) * (sizeof(double) + sizeof(Index)) +
               pattern_->rows.size() * (sizeof(double) + sizeof(Index));
    }

  private:
    using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

    Eigen::Map<const Matrix> view(const double* values) const {
        return {pattern_->size,
                pattern_->size,
                static_cast<Index>(pattern_->rows.size()),
                pattern_->column_starts.data(),
                pattern_->rows.data(),
                values};
    }

    Eigen::SimplicialLDLT<Matrix, Eigen::Lower> solver_;
};

}  // namespace

std::unique_ptr<Factor> make_eigen_factor(std::shared_ptr<const SparsePattern> pattern) {
    return std::make_unique<EigenFactor>(std::move(pattern));
}

}  // namespace magshell
#endif
