// The matrix of Projective Dynamics, factorized once:
//
//   A = W + scale L                     W: masses over the square of the time, L: the surrogate of the energies
//
// among the free unknowns. It is the same along x, y and z, so nodes that are free along an axis make one small matrix for
// it, and axes with the same nodes share a factorization. What is left are few: coordinates of carriers, B their Jacobian,
// and nodes that are held along slanted directions. They are eliminated last (Schur's complement):
//
//   [ A_d    C ] [p]   [b]       C = A_ds B,  X = A_d^-1 C,  S = B^T A_ss B - C^T X
//   [ C^T  B^T A_ss B ] [z] = [c]       z = S^-1 (c - X^T b),  p = A_d^-1 b - X z                  [Qiao21] (17), (18)
//
// so that the soft part stays factorized while joints turn: a new B costs a solve with A_d each coordinate.
#pragma once

#include <Eigen/Cholesky>
#include <map>
#include <memory>
#include <vector>

#include "magshell/assembly/node_matrix.h"
#include "magshell/linalg/factor.h"
#include "magshell/scene/model.h"

namespace magshell {

class ConstantMatrix {
  public:
    explicit ConstantMatrix(const Model& model);

    /// From now on A is this one: factorized again where a number has changed. `weights` are those of an Anchor; `of_nodes` add
    /// to them.
    void set(double scale, const VectorXd& weights, const VectorXd& of_nodes);
    /// From now on B is that of the reduction's last linearization.
    void linearize();

    /// Replaces a vector of the free unknowns by the solution.
    void solve(VectorXd& reduced) const;
    /// The product with a vector of all unknowns.
    VectorXd times(const VectorXd& full) const;

    /// Of its inverse between two nodes, the same along x, y and z; adds the product of a node's column of it with a vector.
    /// Columns are kept until A changes. Throws InvalidInput where the three axes differ, or carriers couple them.
    double inverse(Index row, Index column) const;
    void add_inverse_column(Index node, const Vec3& vector, VectorXd& full) const;
    /// Whether a node is free.
    bool solves(Index node) const;

    /// Of a node: scale L on the diagonal [N/m].
    double stiffness(Index node) const {
        return scale_ * stiffness_.values()[stiffness_.column_starts()[node]];
    }

    int factorizations() const { return factorizations_; }

  private:
    // Axes along which the same nodes are free.
    struct Group {
        std::vector<int> axes;
        std::vector<Index> nodes;                 // by column
        std::vector<std::vector<Index>> reduced;  // by axis and column: where it is among the free unknowns
        std::vector<Index> from;                  // by entry of the pattern: where in L
        std::unique_ptr<Factor> factor;
    };

    void analyse(Group& group);
    void factorize();
    void solve_plain(VectorXd& reduced) const;

    const Model& model_;
    int version_;  // of the values that the surrogate is made of
    NodeMatrix stiffness_;
    double scale_ = 0.0;
    VectorXd weights_;  // of nodes
    std::vector<Group> groups_;
    std::vector<Index> special_;  // free unknowns of no group
    bool linearized_ = false;
    Eigen::MatrixXd coupling_;  // X, a column each of the special ones
    Eigen::LDLT<Eigen::MatrixXd> schur_;
    int factorizations_ = 0;
    std::vector<Index> column_of_;  // by node: its column where the axes share one group, else -1
    mutable std::map<Index, VectorXd> inverse_columns_;

    const VectorXd& inverse_column(Index node) const;
};

}  // namespace magshell
