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
//
// Edge rotations of sheets are points of L whose three numbers all are free in the small matrices ("wide" vectors). Of a
// rotation phi there is the one along the sheet's normal n where it stands now: A^-1 is P S^-1 P^T with (P^T phi) = n phi, S
// being constant, so that what bends stays soft however it has turned.
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

    /// From now on A is this one: factorized again where a number has changed. `weights` are those of an Anchor; `of_nodes` add
    /// to them.
    void set(double scale, const VectorXd& weights, const VectorXd& of_nodes);
    /// From now on B is that of the reduction's last linearization, and normals are those at q.
    void linearize(const VectorXd& q);

    /// Replaces a vector of the free unknowns by the solution.
    void solve(VectorXd& reduced) const;
    /// The product with a vector of all unknowns.
    VectorXd times(const VectorXd& full) const;

    /// Throws InvalidInput where its inverse is not the same along x, y and z.
    void require_isotropic() const;
    /// Whether a node is free, where that is so.
    bool solves(Index node) const { return !groups_.empty() && groups_[0].column_of[node] >= 0; }

    /// A force on each of a few nodes.
    struct Forces {
        std::array<Index, 4> nodes;
        std::array<Vec3, 4> forces;
        int count;
    };
    /// Of some of them, the products f_k . A^-1 f_l. Columns of A^-1 are kept until A changes.
    Eigen::MatrixXd compliance(const std::vector<Forces>& of) const;

    /// Of a node: scale L on the diagonal [N/m].
    double stiffness(Index node) const {
        return scale_ * stiffness_.values()[stiffness_.column_starts()[node]];
    }

    /// That with the masses and what touches.
    double diagonal(Index node) const { return stiffness(node) + weights_[node]; }

    int factorizations() const { return factorizations_; }

  private:
    // Axes along which the same nodes are free; all rotations are free along all of them.
    struct Group {
        std::vector<int> axes;
        std::vector<Index> points;                // by column
        std::vector<std::vector<Index>> reduced;  // by axis and column: where it is among the free unknowns
        std::vector<Index> from;                  // by entry of the pattern: where in L
        std::vector<Index> column_of;             // by point; -1: none
        Eigen::Index first = 0;                   // where its columns begin in wide vectors, axis by axis
        std::unique_ptr<Factor> factor;
        std::map<Index, VectorXd> inverse_columns;  // by column

        Eigen::Index count() const { return static_cast<Eigen::Index>(points.size()); }
    };

    void analyse(Group& group);
    void factorize();
    const VectorXd& inverse_column(Group& group, Index column) const;

    bool is_scalar(Index point) const { return point >= stiffness_.nodes(); }
    const Vec3& normal(Index point) const { return normals_[point - stiffness_.nodes()]; }
    void find_normals(const VectorXd& q);
    /// A vector of all unknowns as three numbers a point, and back; the product with one.
    VectorXd by_point(const VectorXd& full) const;
    VectorXd times_points(const VectorXd& points) const;
    VectorXd wide_of(const VectorXd& points) const;
    VectorXd wide(const VectorXd& reduced) const;
    /// Overwrites what is not special.
    void narrow(const VectorXd& wide, VectorXd& reduced) const;
    void solve_wide(VectorXd& wide) const;

    const Model& model_;
    int version_;  // of the values that the surrogate is made of
    NodeMatrix stiffness_;
    double scale_ = 0.0;
    VectorXd weights_;           // of points
    std::vector<Vec3> normals_;  // of scalars
    mutable std::vector<Group> groups_;
    Eigen::Index wide_size_ = 0;
    std::vector<Index> special_;  // free unknowns of no group
    bool linearized_ = false;
    Eigen::MatrixXd forces_, coupling_;  // C and X, wide, a column each of the special ones
    Eigen::LDLT<Eigen::MatrixXd> schur_;
    int factorizations_ = 0;
};

}  // namespace magshell
