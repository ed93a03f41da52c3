// The constant matrix A of Projective Dynamics and what bodies that touch each other add to it:
//
//   A + sum_k R_k^T K_k R_k,    R_k x = sum_i w_i x_i      K_k: of pair k, along its normal and, where it rubs, across it
//
// K_k changes with every round and couples others with every step, while A stays factorized. With columns c of all
// R_k^T K_k^(1/2) that are not zero,
//
//   (A + c c^T)^-1 = A^-1 - A^-1 c (1 + c^T A^-1 c)^-1 c^T A^-1                                     [Woodbury 1950]
//
// c^T A^-1 c is made of columns of A^-1 of the nodes that touch, which are kept.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "magshell/solve/constant_matrix.h"
#include "magshell/term/pair_stiffness.h"

namespace magshell {

class TouchingMatrix {
  public:
    TouchingMatrix(const Model& model, const ConstantMatrix& matrix) : model_(model), matrix_(matrix) {}

    /// From now on these pairs touch; of too many, the stiffest count.
    void set(const std::vector<PairStiffness>& pairs);
    /// Replaces a vector of the free unknowns by the solution.
    void solve(VectorXd& reduced) const;

  private:
    const Model& model_;
    const ConstantMatrix& matrix_;
    std::vector<ConstantMatrix::Forces> columns_;
    Eigen::LLT<Eigen::MatrixXd> small_;  // 1 + c^T A^-1 c
};

}  // namespace magshell
