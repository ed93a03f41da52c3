// Ties between dofs: the displacement of each tied dof is a sum of those of others, which are not tied themselves, and of prescribed ones.
//
//   u_s = sum_j w_j u_j + t sum_k v_k d_k        t: support factor, d_k: a component of the translation of a support move [m]
//
// With the matrix T of this sum, u = T z for the free dofs z: forces are T^T f, matrices T^T K T. A tied dof couples dofs that share no
// element, such as those of two opposite sides of a periodic cell. Nodes with a frame of their own are tied along its axes.
//
// This class adds up the part of the w_j. DofMap (dof_map.h) adds the part of the moves, since it knows the supports.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "magshell/assembly/system_matrix.h"
#include "magshell/core/types.h"
#include "magshell/dofs/reduced_coordinates.h"
#include "magshell/linalg/factor.h"

namespace magshell {

struct TiedDof {
    struct Part {
        Index dof;
        double weight;
    };
    struct Move {
        Index move;
        int axis;
        double weight;
    };
    Index dof;                // s
    std::vector<Part> parts;  // w_j
    std::vector<Move> moves;  // v_k
};

/// The ties of a scene. They reduce single dofs, so they have no nodes and no coordinates of their own.
class LinearTies : public ReducedCoordinates {
  public:
    /// tied: dofs along the frame of their node, if it is rotated (dof_map.h).
    LinearTies(std::vector<TiedDof> tied, Index full_size);

    const std::vector<TiedDof>& tied() const { return tied_; }
    bool is_tied(Index dof) const { return tied_at_[dof] >= 0; }

    /// Sets the tied dofs of a motion from the others.
    void extend(VectorXd& motion) const;
    /// Adds the gradient with respect to the displacements' origins, the positions of all dofs at rest, from that with respect to the dofs.
    void add_rest_gradient(const VectorXd& by_dofs, VectorXd& out) const;
    /// Adds the forces on tied dofs to all dofs that they follow, or to the free ones alone.
    void gather(VectorXd& forces) const;
    void gather(const VectorXd& forces, VectorXd& reduced) const;

    /// Build the reduced pattern, called in this order: as in ReducedAssembly.
    void collect_couplings(const std::vector<const SystemMatrix*>& matrices,
                           const std::vector<Index>& reduced);
    /// Returns the rows that ties add to a column of the pattern, `none` if there are none.
    const std::set<Index>& rows_of(Index column, const std::set<Index>& none) const;
    void find_entries(const std::vector<const SystemMatrix*>& matrices, const SparsePattern& pattern);

    /// Add the part of T^T K T of one of the matrices that involves tied dofs; the same of a diagonal matrix of all dofs, and its diagonal.
    void add_matrix(std::size_t which, const SystemMatrix& full, double* values) const;
    void add_weights(const VectorXd& weights, double* values) const;
    void add_diagonal(const VectorXd& weights, VectorXd& reduced) const;

    /// Solves T^T W T z = forces for those free dofs that tied ones follow, with a diagonal matrix W of all dofs; z is zero without weight.
    void solve(const VectorXd& weights, const VectorXd& forces, VectorXd& z) const;

    std::size_t bytes() const;

    Index coordinates() const override { return 0; }
    LinkTwists twists(const VectorXd&) const override { return {}; }
    Eigen::MatrixXd curvature(const VectorXd&, const VectorXd&) const override { return {}; }
    void retract(VectorXd&, const VectorXd&) const override {}
    void project_state(VectorXd&, VectorXd*) const override {}
    void project_state_vjp(const VectorXd&, const VectorXd&, VectorXd&, VectorXd&, Gradient&,
                           VectorXd*) const override {}
    VectorXd rounding(const VectorXd&) const override { return {}; }

  private:
    // from: an entry in a matrix of all dofs, or a tied dof in `weights`; to: where it goes in the reduced matrix.
    struct Entry {
        Index from, to;
        double weight;
    };
    using ReducedParts = std::vector<TiedDof::Part>;  // by free dof

    /// Returns the free dofs that a dof is a sum of.
    ReducedParts parts_of(Index dof) const;

    std::vector<TiedDof> tied_;
    std::vector<Index> tied_at_;  // by dof: its index in tied_, else -1
    std::vector<Index> reduced_;  // by dof: its index among the free ones, else negative
    std::map<Index, std::set<Index>> extra_rows_;
    std::vector<std::vector<Entry>> entries_;  // by matrix
    std::vector<Entry> weights_;               // in the pattern of the reduced matrix

    // T^T W T of the free dofs that tied ones follow:
    std::vector<Index> group_, group_dofs_;  // their indices among the free ones and among all, ascending
    std::shared_ptr<const SparsePattern> group_pattern_;
    std::vector<Entry> group_entries_;
    mutable std::unique_ptr<Factor> factor_;
    mutable VectorXd factorized_;  // the weights of the last factorization
};

}  // namespace magshell
