// What a symmetric matrix does not hold of the Jacobian of forces: small unsymmetric blocks, never assembled.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

using Mat9 = Eigen::Matrix<double, 9, 9>;

class Remainder {
  public:
    void clear() {
        points_.clear();
        faces_.clear();
    }
    bool empty() const { return points_.empty() && faces_.empty(); }

    /// A block of one node, and one of three, whose unknowns follow each other.
    void add(Index node, const Mat3& block) { points_.push_back({node, block}); }
    void add(const std::array<Index, 3>& nodes, const Mat9& block) { faces_.push_back({nodes, block}); }

    /// out += R p, or R^T p. All unknowns.
    void add_product(const VectorXd& p, bool transposed, VectorXd& out) const;

  private:
    struct Point {
        Index node;
        Mat3 block;
    };
    struct Face {
        std::array<Index, 3> nodes;
        Mat9 block;
    };
    std::vector<Point> points_;
    std::vector<Face> faces_;
};

}  // namespace magshell
