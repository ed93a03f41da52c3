#include "magshell/solve/touching_matrix.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

// Of the dense part: more would take longer than what it saves.
constexpr std::size_t most_columns = 1000;
// Of the stiffness of a node: less is not worth a column.
constexpr double negligible = 1e-2;

}  // namespace

void TouchingMatrix::set(const std::vector<PairStiffness>& pairs) {
    struct Column {
        double stiffness;  // beside that of the nodes
        ConstantMatrix::Forces forces;
    };
    std::vector<Column> all;
    for (const PairStiffness& pair : pairs) {
        const Eigen::SelfAdjointEigenSolver<Mat3> parts(pair.stiffness);
        double beside = 0.0;
        for (int i = 0; i < pair.count; ++i)
            beside += pair.weights[i] * pair.weights[i] / matrix_.diagonal(pair.nodes[i]);
        for (int a = 0; a < 3; ++a) {
            const double stiffness = parts.eigenvalues()[a] * beside;
            if (!(stiffness > negligible)) continue;
            Column& column = all.emplace_back(Column{stiffness, {pair.nodes, {}, pair.count}});
            for (int i = 0; i < pair.count; ++i)
                column.forces.forces[i] =
                    pair.weights[i] * std::sqrt(parts.eigenvalues()[a]) * parts.eigenvectors().col(a);
        }
    }
    if (all.size() > most_columns) {
        std::stable_sort(all.begin(), all.end(),
                         [](const Column& a, const Column& b) { return a.stiffness > b.stiffness; });
        all.resize(most_columns);
    }
    columns_.clear();
    for (const Column& column : all) columns_.push_back(column.forces);
    if (columns_.empty()) return;
    Eigen::MatrixXd product = matrix_.compliance(columns_);
    product.diagonal().array() += 1.0;
    small_.compute(product);
}

void TouchingMatrix::solve(VectorXd& reduced) const {
    matrix_.solve(reduced);
    if (columns_.empty()) return;
    const VectorXd full = model_.reduction().expand(reduced);
    VectorXd along(columns_.size()), forces = VectorXd::Zero(full.size());
    for (std::size_t k = 0; k < columns_.size(); ++k) {
        along[k] = 0.0;
        for (int i = 0; i < columns_[k].count; ++i)
            along[k] += columns_[k].forces[i].dot(full.segment<3>(3 * columns_[k].nodes[i]));
    }
    small_.solveInPlace(along);
    for (std::size_t k = 0; k < columns_.size(); ++k)
        for (int i = 0; i < columns_[k].count; ++i)
            forces.segment<3>(3 * columns_[k].nodes[i]) += along[k] * columns_[k].forces[i];
    VectorXd back = model_.reduction().vector(forces);
    matrix_.solve(back);
    reduced -= back;
}

}  // namespace magshell
