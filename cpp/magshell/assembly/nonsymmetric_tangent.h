// The nonsymmetric part of the tangent matrix, as a list of small blocks.
//
// The system matrix stores and factorizes the symmetric part only. Two kinds of force have a nonsymmetric part:
//   - friction, drag and muscle rates, which act only within time steps (ForceTerm);
//   - follower loads without a potential, such as a pressure on an open surface, which act always.
// The blocks are never assembled: GMRES multiplies by them (solve/newton/unsymmetric.h), preconditioned with the symmetric factorization.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class NonsymmetricTangent {
  public:
    using Mat39 = Eigen::Matrix<double, 3, 9>;

    /// Blocks of a force B p on a point of a face: p are the displacements of its three nodes, which share the force by `weights`.
    struct FaceBlock {
        std::array<Index, 3> nodes;
        Vec3 weights;
        Mat39 block;
    };

    /// The skew-symmetric block [axis]x between two nodes, or of one node if both indices are equal.
    struct SkewBlock {
        std::array<Index, 2> nodes;
        Vec3 axis;
    };

    /// Blocks between up to four nodes: (i, j) at 4 i + j. Negative nodes are absent.
    struct PairBlock {
        std::array<Index, 4> nodes;
        std::array<Mat3, 16> blocks;
    };

    void clear() {
        node_blocks_.clear();
        face_blocks_.clear();
        skew_blocks_.clear();
        pair_blocks_.clear();
    }
    bool empty() const { return !has_rate_forces() && skew_blocks_.empty(); }
    /// Returns true if it holds blocks of forces that act within time steps only.
    bool has_rate_forces() const {
        return !node_blocks_.empty() || !face_blocks_.empty() || !pair_blocks_.empty();
    }
    const std::vector<SkewBlock>& skew_blocks() const { return skew_blocks_; }

    /// Adds a block of one node; of a point on a face; of two nodes.
    void add(Index node, const Mat3& block) { node_blocks_.push_back({node, block}); }
    void add(const FaceBlock& shared) { face_blocks_.push_back(shared); }
    void add(const SkewBlock& skew) { skew_blocks_.push_back(skew); }
    /// Appends a pair block and returns it for the caller to fill; the reference is valid until the next call.
    PairBlock& append_pair() { return pair_blocks_.emplace_back(); }
    /// Appends `count` pair blocks and returns the first for the caller to fill; the pointer is valid until the next call.
    PairBlock* append_pairs(std::size_t count) {
        pair_blocks_.resize(pair_blocks_.size() + count);
        return pair_blocks_.data() + pair_blocks_.size() - count;
    }
    /// Appends `count` face blocks and returns the first for the caller to fill; the pointer is valid until the next call.
    FaceBlock* append_face_blocks(std::size_t count) {
        face_blocks_.resize(face_blocks_.size() + count);
        return face_blocks_.data() + face_blocks_.size() - count;
    }

    /// Adds R p, or R^T p if transposed, to out; both are of all dofs.
    void add_product(const VectorXd& p, bool transposed, VectorXd& out) const;

  private:
    struct NodeBlock {
        Index node;
        Mat3 block;
    };
    std::vector<NodeBlock> node_blocks_;
    std::vector<FaceBlock> face_blocks_;
    std::vector<SkewBlock> skew_blocks_;
    std::vector<PairBlock> pair_blocks_;
};

}  // namespace magshell
