// The constant system matrix of Projective Dynamics, which is factorized once per time step length.
//
//   A = W + scale L                     W: masses over the square of the stage time, L: projective stiffness of the energies
//
// A acts on the free dofs. It is the same along x, y and z, so the nodes that are free along one axis make one small matrix,
// and axes with the same free nodes share a factorization. A few "special" dofs remain: generalized coordinates of rigid
// bodies and skeletons, with Jacobian B, and nodes that are held along directions other than x, y, z. They are eliminated last, by a
// Schur complement S:
//
//   [ A_d    C ] [p]   [b]       C = A_ds B,  X = A_d^-1 C,  S = B^T A_ss B - C^T X
//   [ C^T  B^T A_ss B ] [z] = [c]       z = S^-1 (c - X^T b),  p = A_d^-1 b - X z                  [Qiao21] (17), (18)
//
// The factorization of A_d therefore survives rotations of the joints: a new B costs one solve with A_d per coordinate.
//
// An edge rotation of a shell is represented in L by a point with three components, which all are free in the small matrices
// (vectors in this representation are called "wide"). Only the component along the current shell normal n is a dof phi: with
// P^T phi = n phi, A^-1 is replaced by P S^-1 P^T with constant S, so the bending stiffness follows the shell as it rotates.
#pragma once

#include <Eigen/Cholesky>
#include <array>
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

    /// Sets A to these values and factorizes again if one of them has changed. weights: those of a ProximalTerm [N/m], of all
    /// dofs; of_nodes: added to the diagonal, one number per node [N/m].
    void set(double scale, const VectorXd& weights, const VectorXd& of_nodes);
    /// Sets B to the Jacobian of the last linearization of the DofMap, and the normals to those at q.
    void linearize(const VectorXd& q);

    /// Replaces a vector of the free dofs by the solution of A p = vector.
    void solve(VectorXd& reduced) const;
    /// Returns the product of A with a vector of all dofs.
    VectorXd times(const VectorXd& full) const;

    /// Throws InvalidInput if A^-1 differs between x, y and z.
    void require_isotropic() const;
    /// Returns true if a node is free, provided that A is isotropic.
    bool solves(Index node) const { return !groups_.empty() && groups_[0].column_of[node] >= 0; }

    /// Forces on up to four nodes.
    struct Forces {
        std::array<Index, 4> nodes;
        std::array<Vec3, 4> forces;
        int count;
    };
    /// Returns the matrix of the products f_k . A^-1 f_l of some forces [m N]. The columns of A^-1 are cached until A changes.
    Eigen::MatrixXd compliance(const std::vector<Forces>& of) const;

    /// Returns the diagonal entry of scale L at a node [N/m].
    double stiffness(Index node) const {
        return scale_ * stiffness_.values()[stiffness_.column_starts()[node]];
    }

    /// Returns the diagonal entry of A at a node, with its mass and its contact stiffness [N/m].
    double diagonal(Index node) const { return stiffness(node) + weights_[node]; }

    int factorizations() const { return factorizations_; }

  private:
    // The axes along which the same nodes are free, with one factorization. Edge rotations are free along all axes.
    struct Group {
        std::vector<int> axes;
        std::vector<Index> points;                // by column of the small matrix
        std::vector<std::vector<Index>> reduced;  // by axis and column: index among the free dofs
        std::vector<Index> from;                  // by entry of the small matrix: its position in L
        std::vector<Index> column_of;             // by point: its column; -1 if it has none
        Eigen::Index first = 0;                   // start of its columns in wide vectors, axis by axis
        std::unique_ptr<Factor> factor;
        std::map<Index, VectorXd> inverse_columns;  // cached columns of the inverse

        Eigen::Index count() const { return static_cast<Eigen::Index>(points.size()); }
    };

    void analyse(Group& group);
    void factorize();
    const VectorXd& inverse_column(Group& group, Index column) const;

    bool is_scalar(Index point) const { return point >= stiffness_.nodes(); }
    const Vec3& normal(Index point) const { return normals_[point - stiffness_.nodes()]; }
    void find_normals(const VectorXd& q);
    /// Returns a vector of all dofs as three components per point; the transpose of this; A times a vector by points.
    VectorXd by_point(const VectorXd& full) const;
    VectorXd times_points(const VectorXd& points) const;
    VectorXd wide_of(const VectorXd& points) const;
    VectorXd wide(const VectorXd& reduced) const;
    /// Overwrites the entries of the free dofs that are not special.
    void narrow(const VectorXd& wide, VectorXd& reduced) const;
    void solve_wide(VectorXd& wide) const;

    const Model& model_;
    int version_;  // of the parameters that L was computed from
    NodeMatrix stiffness_;
    double scale_ = 0.0;
    VectorXd weights_;           // [N/m] per point
    std::vector<Vec3> normals_;  // unit normal per edge rotation
    mutable std::vector<Group> groups_;
    Eigen::Index wide_size_ = 0;
    std::vector<Index> special_;  // indices of the free dofs that belong to no group
    bool linearized_ = false;
    Eigen::MatrixXd forces_, coupling_;  // C and X as wide vectors, one column per special dof
    Eigen::LDLT<Eigen::MatrixXd> schur_;
    int factorizations_ = 0;
};

}  // namespace magshell
