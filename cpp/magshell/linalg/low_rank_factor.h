// LowRankFactor: a factorization of a sparse matrix A plus a few dense columns, K = A + U S U^T with S = +-1
// (each column contains the square root of its stiffness), by a bordered system,
//
//   [ A    U   ] [ x ]   [ b ]
//   [ U^T  -S  ] [ y ] = [ 0 ],        M = S + U^T A^-1 U,      x = A^-1 b - A^-1 U M^-1 U^T A^-1 b
//
// Counting the inertia of the bordered matrix in both ways gives
//
//   negative(K) = negative(A) + positive(M) - positive(S).
//
// For a very stiff column M stays as large as necessary, so no digits are lost in the limit of a constraint.
#pragma once

#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

class LowRankFactor final : public Factor {
  public:
    explicit LowRankFactor(std::unique_ptr<Factor> sparse);

    /// Sets the low-rank part sum_k stiffness_k column_k column_k^T, columns (size, k) and stiffness (k,),
    /// until it is set again.
    void set_low_rank(Eigen::MatrixXd columns, const VectorXd& stiffness);
    FactorReport factorize() override;
    VectorXd image(const VectorXd& x) const override;
    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override;
    /// The other one has the same low-rank part until its own is set.
    std::unique_ptr<Factor> sibling() const override;

    std::string name() const override { return sparse_->name(); }
    std::int64_t nonzeros() const override { return sparse_->nonzeros() + columns_.size(); }
    double flops() const override;
    std::size_t bytes() const override { return sparse_->bytes() + bytes_of_columns(); }
    std::size_t own_bytes() const override { return sparse_->own_bytes() + bytes_of_columns(); }

  private:
    std::size_t bytes_of_columns() const {
        return sizeof(double) * static_cast<std::size_t>(columns_.size() + solved_.size() + border_.size());
    }
    void solve_once(Eigen::Ref<Eigen::MatrixXd> rhs) const;

    std::unique_ptr<Factor> sparse_;
    Eigen::MatrixXd columns_, solved_, border_;  // U, A^-1 U, M^-1
    VectorXd signs_;                             // S
};

}  // namespace magshell
