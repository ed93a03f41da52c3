#include "magshell/linalg/dense_decompositions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace magshell {

using Eigen::MatrixXd;

SymmetricEigen eigen_of_symmetric(const MatrixXd& matrix) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen eigen_of_tridiagonal(const VectorXd& diagonal, const VectorXd& beside) {
    Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
    solver.computeFromTridiagonal(diagonal, beside);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

ComplexEigen eigen_of_real(const MatrixXd& matrix) {
    const Eigen::EigenSolver<MatrixXd> solver(matrix);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd triangle_of_qr(const MatrixXd& matrix) {
    return Eigen::HouseholderQR<MatrixXd>(matrix)
        .matrixQR()
        .topRows(matrix.cols())
        .triangularView<Eigen::Upper>();
}

MatrixXd orthonormal_columns(const MatrixXd& matrix) {
    return Eigen::HouseholderQR<MatrixXd>(matrix).householderQ() *
           MatrixXd::Identity(matrix.rows(), matrix.cols());
}

VectorXd least_squares(const MatrixXd& matrix, const VectorXd& rhs) {
    return matrix.colPivHouseholderQr().solve(rhs);
}

}  // namespace magshell
