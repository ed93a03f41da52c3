// A factorization of a sparse matrix A and a few dense columns beside it, K = A + U S U^T with S = +-1 (the stiffness of a
// column is put into it): by bordering,
//
//   [ A    U   ] [ x ]   [ b ]
//   [ U^T  -S  ] [ y ] = [ 0 ],        M = S + U^T A^-1 U,      x = A^-1 b - A^-1 U M^-1 U^T A^-1 b
//
// and with the inertia of the bordered matrix, counted both ways round, K has
//
//   negative(K) = negative(A) + positive(M) - positive(S).
//
// However stiff a column is, M stays as large as it has to be: nothing is lost in the limit of a constraint.
#pragma once

#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

class LowRankFactor final : public Factor {
  public:
    explicit LowRankFactor(std::unique_ptr<Factor> sparse);

    /// What is added to the sparse matrix: sum_k stiffness_k column_k column_k^T, (size, k) and (k,), until it is set again.
    void set_low_rank(Eigen::MatrixXd columns, const VectorXd& stiffness);
    FactorReport factorize() override;
    VectorXd image(const VectorXd& x) const override;
    void solve(Eigen::Ref<Eigen::MatrixXd> rhs) const override;
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
