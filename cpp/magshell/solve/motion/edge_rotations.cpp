#include "magshell/solve/motion/edge_rotations.h"

#include <Eigen/SparseCholesky>

#include "magshell/core/errors.h"

namespace magshell {

struct EdgeRotationEquilibrium::Factorization {
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> of;
};

EdgeRotationEquilibrium::EdgeRotationEquilibrium(Model& model, const VectorXd& q,
                                                 const LoadParameters& load_parameters)
    : model_(model), first_(model.nodes().first_scalar()), factor_(new Factorization) {
    model.evaluate(q, load_parameters);
    model.assemble(q, load_parameters, false);
    const SystemMatrix& matrix = model.matrix();
    std::vector<Eigen::Triplet<double>> entries;
    for (Index column = first_; column < matrix.size(); ++column)
        for (Index k = matrix.column_starts()[column]; k < matrix.column_starts()[column + 1]; ++k)
            entries.emplace_back(matrix.rows()[k] - first_, column - first_, matrix.values()[k]);
    const Index n = matrix.size() - first_;
    Eigen::SparseMatrix<double> lower(n, n);
    lower.setFromTriplets(entries.begin(), entries.end());
    factor_->of.compute(lower);
    if (n > 0 && factor_->of.info() != Eigen::Success)
        throw InvalidInput(
            "the edge rotations of the start have no bending stiffness, so they cannot be computed: give "
            "them");
}

EdgeRotationEquilibrium::~EdgeRotationEquilibrium() = default;

VectorXd EdgeRotationEquilibrium::correction() const {
    return adjoint(model_.residual().gradient);
}

VectorXd EdgeRotationEquilibrium::adjoint(const VectorXd& by_state) const {
    VectorXd solution = VectorXd::Zero(model_.size());
    const Index n = model_.size() - first_;
    if (n > 0) solution.tail(n) = -factor_->of.solve(by_state.tail(n));
    return solution;
}

}  // namespace magshell
