// What a symmetric matrix does not hold of the Jacobian of forces: small unsymmetric blocks, never assembled.
//
// Those of forces that act within time steps, and those of loads without a potential, which act always.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class Remainder {
  public:
    using Mat39 = Eigen::Matrix<double, 3, 9>;

    /// A force B p that three nodes share by their weights, and that their motions p cause.
    struct Shared {
        std::array<Index, 3> nodes;
        Vec3 weights;
        Mat39 block;
    };

    /// Both nodes feel [axis]x of the other's motion; one node that is both, that of its own.
    struct Skew {
        std::array<Index, 2> nodes;
        Vec3 axis;
    };

    /// Blocks of up to four nodes: (i, j) at 4 i + j. Negative: no node.
    struct Pair {
        std::array<Index, 4> nodes;
        std::array<Mat3, 16> blocks;
    };

    void clear() {
        points_.clear();
        shared_.clear();
        skews_.clear();
        pairs_.clear();
    }
    bool empty() const { return !of_motion() && skews_.empty(); }
    /// Whether there are blocks of forces that act within time steps only.
    bool of_motion() const { return !points_.empty() || !shared_.empty() || !pairs_.empty(); }
    const std::vector<Skew>& skews() const { return skews_; }

    /// A block of one node.
    void add(Index node, const Mat3& block) { points_.push_back({node, block}); }
    void add(const Shared& shared) { shared_.push_back(shared); }
    void add(const Skew& skew) { skews_.push_back(skew); }
    /// One more, for the caller to fill before the next call.
    Pair& add_pair() { return pairs_.emplace_back(); }
    /// So many more, for the caller to fill before the next call.
    Shared* extend(std::size_t count) {
        shared_.resize(shared_.size() + count);
        return shared_.data() + shared_.size() - count;
    }

    /// out += R p, or R^T p. All unknowns.
    void add_product(const VectorXd& p, bool transposed, VectorXd& out) const;

  private:
    struct Point {
        Index node;
        Mat3 block;
    };
    std::vector<Point> points_;
    std::vector<Shared> shared_;
    std::vector<Skew> skews_;
    std::vector<Pair> pairs_;
};

}  // namespace magshell
