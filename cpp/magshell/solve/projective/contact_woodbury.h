// Low-rank update of the constant matrix A of Projective Dynamics by the contact pairs of bodies:
//
//   A + sum_k R_k^T K_k R_k,    R_k x = sum_i w_i x_i      K_k: stiffness of pair k along its normal and, with friction, across it
//
// K_k changes in every iteration and the pairs in every step, while A stays factorized. With a column c for every nonzero eigenvalue
// of the R_k^T K_k^(1/2),
//
//   (A + c c^T)^-1 = A^-1 - A^-1 c (1 + c^T A^-1 c)^-1 c^T A^-1                                     [Woodbury 1950]
//
// c^T A^-1 c consists of entries of those columns of A^-1 that belong to nodes in contact; ConstantMatrix caches these columns.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "magshell/solve/projective/constant_matrix.h"
#include "magshell/terms/contact/pair_stiffness.h"

namespace magshell {

class ContactWoodbury {
  public:
    ContactWoodbury(const Model& model, const ConstantMatrix& matrix) : model_(model), matrix_(matrix) {}

    /// Sets the contact pairs. If they are too many, only the stiffest ones are used.
    void set(const std::vector<PairStiffness>& pairs);
    /// Replaces a vector of the free dofs by the solution.
    void solve(VectorXd& reduced) const;

  private:
    const Model& model_;
    const ConstantMatrix& matrix_;
    std::vector<ConstantMatrix::Forces> columns_;
    Eigen::LLT<Eigen::MatrixXd> small_;  // 1 + c^T A^-1 c
};

}  // namespace magshell
