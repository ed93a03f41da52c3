// OperatorFactor: a factorization of a sparse matrix A plus a symmetric operator H that is known by its products only, K = A + H.
//
// Solves use GMRES, preconditioned with A. The inertia is that of K. If A is positive definite, K has as many negative eigenvalues as A^-1 H
// has below -1, which Lanczos' method finds in the inner product of A (Parlett, The Symmetric Eigenvalue Problem, 15.11). A multiple
// eigenvalue is counted once, so the number of negative pivots is a lower bound. If the count is not settled, it is reported as one at
// least, with one perturbed pivot. If A is not positive definite, a multiple of its diagonal that makes it so is added to A and
// subtracted from H.
#pragma once

#include <memory>

#include "magshell/linalg/factor.h"
#include "magshell/linalg/krylov/repeated_operator.h"

namespace magshell {

class OperatorFactor final : public Factor {
  public:
    /// Returns H x.
    using Operator = RepeatedOperator::Product;

    explicit OperatorFactor(std::unique_ptr<Factor> sparse);

    /// Sets H until it is set again; two empty functions are zero. rough: nearly the same product in less time, for solves with a large
    /// tolerance and for counts that are far from a change. is_constant: whether the product stays the same until then.
    void set_operator(Operator product, Operator rough, bool is_constant = true) {
        operator_ = RepeatedOperator(std::move(product), size(), is_constant);
        rough_ = [exact = operator_, rough = std::move(rough)](const VectorXd& x) {
            return exact.is_dense() ? exact(x) : rough(x);
        };
    }
    FactorReport factorize() override;
    /// A deferred report has the negative eigenvalues of A.
    void set_count_deferred(bool deferred) override { deferred_ = deferred; }
    FactorReport complete_report() override;
    VectorXd image(const VectorXd& x) const override;
    /// Throws InvalidInput if GMRES does not converge.
    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override;
    void solve_approximately(VectorXd& rhs, double tolerance) const override;
    std::unique_ptr<Factor> sibling() const override;

    std::string name() const override { return sparse_->name(); }
    std::int64_t nonzeros() const override { return sparse_->nonzeros(); }
    double flops() const override { return sparse_->flops(); }
    std::size_t bytes() const override { return sparse_->bytes() + bytes_of_operator(); }
    std::size_t own_bytes() const override { return sparse_->own_bytes() + bytes_of_operator(); }

  private:
    /// Returns the memory of the entries of A, of the matrix of H if there is one, and of the vectors of the largest count.
    std::size_t bytes_of_operator() const {
        return entries_.size() * sizeof(double) + operator_.bytes() + count_bytes_;
    }
    /// Returns a positive definite factorization of A plus a multiple of its diagonal; nullptr if there is none. values: of A. shift: set
    /// to that multiple of the diagonal.
    std::unique_ptr<Factor> shifted(const LargeVector<double>& values, VectorXd& shift) const;

    std::unique_ptr<Factor> sparse_;
    RepeatedOperator operator_;
    Operator rough_;
    LargeVector<double> entries_;  // of A, which a factorization overwrites
    std::size_t count_bytes_ = 0;
    bool deferred_ = false, counted_ = true;
};

}  // namespace magshell
