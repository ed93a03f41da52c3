// Decompositions of dense matrices of any size. Eigen's templates for them take seconds to compile, so they are compiled once, here.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// The eigenvalues of a symmetric matrix in ascending order, and its orthonormal eigenvectors as columns.
struct SymmetricEigen {
    VectorXd values;
    Eigen::MatrixXd vectors;
};

SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& matrix);
/// Decomposes a tridiagonal matrix. beside: its entries next to the diagonal, one fewer.
SymmetricEigen eigen_of_tridiagonal(const VectorXd& diagonal, const VectorXd& beside);

/// The eigenvalues of a real matrix, and its eigenvectors as columns.
struct ComplexEigen {
    Eigen::VectorXcd values;
    Eigen::MatrixXcd vectors;
};

ComplexEigen eigen_of_real(const Eigen::MatrixXd& matrix);

/// Returns R of the decomposition Q R, the lower triangle filled with zeros. matrix: at least as many rows as columns.
Eigen::MatrixXd triangle_of_qr(const Eigen::MatrixXd& matrix);
/// Returns the first columns of Q, as many as the matrix has.
Eigen::MatrixXd orthonormal_columns(const Eigen::MatrixXd& matrix);

/// Returns the x that minimizes |A x - b|, by a QR decomposition with column pivoting.
VectorXd least_squares(const Eigen::MatrixXd& matrix, const VectorXd& rhs);

}  // namespace magshell
