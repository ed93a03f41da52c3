#include "magshell/solve/projective/contact_woodbury.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

// Columns of the update, at most: a larger dense matrix takes longer than it saves. See test_a_sheet_that_lands_beside_a_block.
constexpr std::size_t max_update_columns = 1000;
// [-] Stiffness of a pair, over that of its nodes, below which it gets no column; see test_bodies_exchange_momentum_and_gain_no_energy.
constexpr double negligible_stiffness = 1e-2;

}  // namespace

void ContactWoodbury::set(const std::vector<PairStiffness>& pairs) {
    struct Column {
        double stiffness;  // over that of its nodes
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
            if (!(stiffness > negligible_stiffness)) continue;
            Column& column = all.emplace_back(Column{stiffness, {pair.nodes, {}, pair.count}});
            for (int i = 0; i < pair.count; ++i)
                column.forces.forces[i] =
                    pair.weights[i] * std::sqrt(parts.eigenvalues()[a]) * parts.eigenvectors().col(a);
        }
    }
    if (all.size() > max_update_columns) {
        std::stable_sort(all.begin(), all.end(),
                         [](const Column& a, const Column& b) { return a.stiffness > b.stiffness; });
        all.resize(max_update_columns);
    }
    columns_.clear();
    for (const Column& column : all) columns_.push_back(column.forces);
    if (columns_.empty()) return;
    Eigen::MatrixXd product = matrix_.compliance(columns_);
    product.diagonal().array() += 1.0;
    small_.compute(product);
}

void ContactWoodbury::solve(VectorXd& reduced) const {
    matrix_.solve(reduced);
    if (columns_.empty()) return;
    const VectorXd full = model_.dof_map().expand(reduced);
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
    VectorXd back = model_.dof_map().vector(forces);
    matrix_.solve(back);
    reduced -= back;
}

}  // namespace magshell
