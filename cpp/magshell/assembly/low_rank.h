// The part of a Hessian that couples many nodes in a few directions only: sum_k s_k u_k u_k^T, for the volume of a cavity or the length
// of a tendon. It is never assembled; linalg/low_rank_factor.h adds it to the factorization.
#pragma once

#include <utility>
#include <vector>

#include "magshell/dofs/dof_map.h"

namespace magshell {

class LowRank {
  public:
    void clear() { columns_.clear(); }
    bool empty() const { return columns_.empty(); }

    /// Adds stiffness u u^T, where u has these slopes at these nodes, each given once.
    void add(std::vector<Index> nodes, std::vector<Vec3> slopes, double stiffness) {
        if (stiffness != 0.0) columns_.push_back({std::move(nodes), std::move(slopes), stiffness});
    }

    /// Adds A x to y, both of all dofs.
    void add_product(const VectorXd& x, VectorXd& y) const {
        for (const Column& each : columns_) {
            double along = 0.0;
            for (std::size_t k = 0; k < each.nodes.size(); ++k)
                along += each.slopes[k].dot(x.segment<3>(3 * each.nodes[k]));
            for (std::size_t k = 0; k < each.nodes.size(); ++k)
                y.segment<3>(3 * each.nodes[k]) += each.stiffness * along * each.slopes[k];
        }
    }

    void add_diagonal(VectorXd& out) const {
        for (const Column& each : columns_)
            for (std::size_t k = 0; k < each.nodes.size(); ++k)
                out.segment<3>(3 * each.nodes[k]) += each.stiffness * each.slopes[k].cwiseAbs2();
    }

    /// Returns the vectors u as columns, with `size` rows.
    Eigen::MatrixXd columns(Index size) const {
        Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size, static_cast<Index>(columns_.size()));
        for (std::size_t c = 0; c < columns_.size(); ++c)
            for (std::size_t k = 0; k < columns_[c].nodes.size(); ++k)
                all.block<3, 1>(3 * columns_[c].nodes[k], static_cast<Index>(c)) = columns_[c].slopes[k];
        return all;
    }
    /// Returns the vectors u as columns, of the free dofs.
    Eigen::MatrixXd reduced(const DofMap& reduction, Index size) const {
        const Eigen::MatrixXd all = columns(size);
        Eigen::MatrixXd free(reduction.size(), all.cols());
        for (Index c = 0; c < all.cols(); ++c) free.col(c) = reduction.vector(all.col(c));
        return free;
    }
    VectorXd stiffness() const {
        VectorXd all(static_cast<Index>(columns_.size()));
        for (std::size_t c = 0; c < columns_.size(); ++c) all[static_cast<Index>(c)] = columns_[c].stiffness;
        return all;
    }

  private:
    struct Column {
        std::vector<Index> nodes;
        std::vector<Vec3> slopes;
        double stiffness;
    };
    std::vector<Column> columns_;
};

}  // namespace magshell
