// The part of a Hessian that couples many nodes in a few directions only: sum_k s_k u_k u_k^T, for the volume of a cavity or the length
// of a tendon. It is never assembled; linalg/low_rank_factor.h adds it to the factorization.
#pragma once

#include <utility>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class DofMap;

class LowRank {
  public:
    void clear() { columns_.clear(); }
    bool empty() const { return columns_.empty(); }

    /// Adds stiffness u u^T, where u has these slopes at these nodes, each given once.
    void add(std::vector<Index> nodes, std::vector<Vec3> slopes, double stiffness) {
        if (stiffness != 0.0) columns_.push_back({std::move(nodes), std::move(slopes), stiffness});
    }

    /// Adds A x to y, both of all dofs.
    void add_product(const VectorXd& x, VectorXd& y) const;
    void add_diagonal(VectorXd& out) const;

    /// Returns the vectors u as columns, with `size` rows.
    Eigen::MatrixXd columns(Index size) const;
    /// Returns the vectors u as columns, of the free dofs.
    Eigen::MatrixXd reduced(const DofMap& dof_map, Index size) const;
    VectorXd stiffness() const;

  private:
    struct Column {
        std::vector<Index> nodes;
        std::vector<Vec3> slopes;
        double stiffness;
    };
    std::vector<Column> columns_;
};

}  // namespace magshell
