#include "magshell/assembly/low_rank.h"

#include "magshell/dofs/dof_map.h"

namespace magshell {

void LowRank::add_product(const VectorXd& x, VectorXd& y) const {
    for (const Column& each : columns_) {
        double along = 0.0;
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            along += each.slopes[k].dot(x.segment<3>(3 * each.nodes[k]));
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            y.segment<3>(3 * each.nodes[k]) += each.stiffness * along * each.slopes[k];
    }
}

void LowRank::add_diagonal(VectorXd& out) const {
    for (const Column& each : columns_)
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            out.segment<3>(3 * each.nodes[k]) += each.stiffness * each.slopes[k].cwiseAbs2();
}

Eigen::MatrixXd LowRank::columns(Index size) const {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size, static_cast<Index>(columns_.size()));
    for (std::size_t c = 0; c < columns_.size(); ++c)
        for (std::size_t k = 0; k < columns_[c].nodes.size(); ++k)
            all.block<3, 1>(3 * columns_[c].nodes[k], static_cast<Index>(c)) = columns_[c].slopes[k];
    return all;
}

Eigen::MatrixXd LowRank::reduced(const DofMap& dof_map, Index size) const {
    const Eigen::MatrixXd all = columns(size);
    Eigen::MatrixXd free(dof_map.size(), all.cols());
    for (Index c = 0; c < all.cols(); ++c) free.col(c) = dof_map.vector(all.col(c));
    return free;
}

VectorXd LowRank::stiffness() const {
    VectorXd all(static_cast<Index>(columns_.size()));
    for (std::size_t c = 0; c < columns_.size(); ++c) all[static_cast<Index>(c)] = columns_[c].stiffness;
    return all;
}

}  // namespace magshell
