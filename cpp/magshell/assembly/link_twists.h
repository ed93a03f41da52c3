// B of the nodes of links in trees, by the twists of the links:                              [Qiao21] 4, Algorithm 2
//
//   dx = v + w x (x - c)                          of a node of a link that moves by the twist (v, w) about its point c
//   (v, w) = sum_j t_j z_j                        over the coordinates on the way to it, its own ones last
//
// so that B = N T, with six numbers a link and coordinate for the rows of all its nodes: O(links x depth) of them. Forces
// on nodes add up to a wrench a link, and wrenches go up the tree.
#pragma once

#include <memory>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// What of a tree does not change.
struct LinkPaths {
    std::vector<Index> parent;            // of each link, one before it; negative: none
    std::vector<Index> own;               // how many coordinates it adds to its parent's
    std::vector<Index> start = {0};       // where its coordinates begin in `coordinate`; links + 1
    std::vector<Index> coordinate;        // those on the way to each link
    std::vector<Index> node_start = {0};  // links + 1
    std::vector<Index> link;              // of each node
    Index coordinates = 0;

    Index n_links() const { return static_cast<Index>(parent.size()); }
    Index n_nodes() const { return node_start.back(); }
    /// Its own coordinates, each the number that a column of B has.
    void add_link(Index parent, const std::vector<Index>& own, Index nodes);
};

class LinkTwists {
  public:
    using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic>;
    /// Of what acts on links, for each of `columns` motions: column link * columns + j.
    struct Wrenches {
        Twists all;
        Index columns;
        Wrenches(Index links, Index n) : all(Twists::Zero(6, links * n)), columns(n) {}
        auto of(Index link, Index j) { return all.col(link * columns + j); }
    };
    /// A part of a matrix of all nodes, by links: forces on one as another one moves.
    struct Block {
        Index row, column;
        Mat6 value;
    };

    LinkTwists() = default;
    /// points: c of each link. arms: x - c of each node. twists: one for each of paths->coordinate.
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

    /// Adds the wrench of a force along a row; that of a unit force.
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
    /// Adds T^T a, of a wrench on a link, to the first n numbers of `to`.
    void add_wrench(Index link, const Vec6& a, Index n, double* to) const {
        for (Index k = paths_->start[link]; k < paths_->start[link + 1]; ++k)
            if (paths_->coordinate[k] < n) to[paths_->coordinate[k]] += a.dot(twists_.col(k));
    }

    /// B z of all coordinates, or of the first ones; B^T f.
    VectorXd motion(const VectorXd& z) const;
    VectorXd pull_back(const VectorXd& rows) const;
    /// B z of the coordinates from the first one given.
    VectorXd motion_from(Index first, const VectorXd& z) const;
    /// The sum over blocks of T^T U T, a row each for the coordinates of `of_rows`.
    Eigen::MatrixXd product(const std::vector<Block>& blocks, const LinkTwists& of_rows) const;
    /// B^T w B, of weights of rows that are the same along the three axes of a node.
    Eigen::MatrixXd product(const VectorXd& weights) const;
    /// B itself.
    Eigen::MatrixXd matrix() const;

    std::size_t bytes() const {
        return twists_.size() * sizeof(double) + (arms_.capacity() + points_.capacity()) * sizeof(Vec3);
    }

  private:
    /// T^T W.
    Eigen::MatrixXd up(Wrenches wrenches) const;

    std::shared_ptr<const LinkPaths> paths_;
    std::vector<Vec3> points_, arms_;
    Twists twists_;
};

}  // namespace magshell
