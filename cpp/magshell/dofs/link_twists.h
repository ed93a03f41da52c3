// The Jacobian B of nodes on links in trees, stored as twists of the links:                   [Qiao21] 4, Algorithm 2
//
//   dx = v + w x (x - c)                          velocity of a node of a link with twist (v, w) about its point c
//   (v, w) = sum_j t_j z_j                        over the coordinates on the path to the link, its own last
//
// so that B = N T, with six numbers per link and coordinate for the rows of all its nodes: O(links x depth) in total. Forces on
// nodes are summed to a wrench per link, and the wrenches are propagated up the tree.
#pragma once

#include <memory>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// The topology of a tree of links.
struct LinkPaths {
    std::vector<Index> parent;            // of each link, an earlier one; negative: none
    std::vector<Index> own;               // number of coordinates that it adds to its parent's
    std::vector<Index> start = {0};       // where its coordinates begin in `coordinate`; links + 1 entries
    std::vector<Index> coordinate;        // those on the path to each link
    std::vector<Index> node_start = {0};  // where its nodes begin; links + 1 entries
    std::vector<Index> link;              // of each node
    Index coordinates = 0;

    Index n_links() const { return static_cast<Index>(parent.size()); }
    Index n_nodes() const { return node_start.back(); }
    /// Adds a link. own: the columns of B of its own coordinates.
    void add_link(Index parent, const std::vector<Index>& own, Index nodes);
};

class LinkTwists {
  public:
    using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic>;
    /// Wrenches on all links, for each of n motions: column link * n + j.
    struct Wrenches {
        Twists all;
        Index columns;
        Wrenches(Index links, Index n) : all(Twists::Zero(6, links * n)), columns(n) {}
        auto of(Index link, Index j) { return all.col(link * columns + j); }
    };
    /// A 6 x 6 block between two links: the wrench on one due to the twist of another.
    struct Block {
        Index row, column;
        Mat6 value;
    };

    LinkTwists() = default;
    /// points: c of each link. arms: x - c of each node. twists: one for each entry of paths->coordinate.
    LinkTwists(std::shared_ptr<const LinkPaths> paths, std::vector<Vec3> points, std::vector<Vec3> arms,
               Twists twists)
        : paths_(std::move(paths)),
          points_(std::move(points)),
          arms_(std::move(arms)),
          twists_(std::move(twists)) {}

    Index coordinates() const { return paths_->coordinates; }
    Index rows() const { return 3 * paths_->n_nodes(); }
    Index n_links() const { return paths_->n_links(); }
    Index link_of_row(Index row) const { return paths_->link[row / 3]; }

    /// Adds the wrench of a force along a row; returns that of a unit force.
    void add_force(Index row, double force, Vec6& to) const {
        const Vec3& arm = arms_[row / 3];
        const int c = row % 3, d = (c + 1) % 3, e = (c + 2) % 3;
        to[c] += force;
        to[3 + d] += force * arm[e];
        to[3 + e] -= force * arm[d];
    }
    Vec6 wrench(Index row) const {
        Vec6 out = Vec6::Zero();
        add_force(row, 1.0, out);
        return out;
    }
    /// Adds T^T a, for a wrench on a link, to the first n numbers of `to`.
    void add_wrench(Index link, const Vec6& a, Index n, double* to) const {
        for (Index k = paths_->start[link]; k < paths_->start[link + 1]; ++k)
            if (paths_->coordinate[k] < n) to[paths_->coordinate[k]] += a.dot(twists_.col(k));
    }

    /// Return B z, for all coordinates or the first ones, and B^T f.
    VectorXd motion(const VectorXd& z) const;
    VectorXd pull_back(const VectorXd& rows) const;
    /// Returns B z for the coordinates from `first` on.
    VectorXd motion_from(Index first, const VectorXd& z) const;
    /// Returns the sum over blocks of T^T U T, with a row for each coordinate of `of_rows`.
    Eigen::MatrixXd product(const std::vector<Block>& blocks, const LinkTwists& of_rows) const;
    /// Returns B^T w B for weights of rows that are the same along the three axes of a node.
    Eigen::MatrixXd product(const VectorXd& weights) const;
    /// Returns B as a dense matrix.
    Eigen::MatrixXd matrix() const;

    std::size_t bytes() const {
        return twists_.size() * sizeof(double) + (arms_.capacity() + points_.capacity()) * sizeof(Vec3);
    }

  private:
    /// Returns T^T W by propagating the wrenches up the tree.
    Eigen::MatrixXd up(Wrenches wrenches) const;

    std::shared_ptr<const LinkPaths> paths_;
    std::vector<Vec3> points_, arms_;
    Twists twists_;
};

}  // namespace magshell
