// CornerForm: quadratic forms of the corner positions of two rigid links, such as lengths and sines between
// vectors fixed to them.
//
//   f = 1/2 sum h_kl x_k . x_l + sum b_k . x_k + c          corners 0 to 3 belong to the parent, 4 to 7 to the child
//
// A vector y fixed to a link is R y = sum gamma_k x_k with gamma_k = rho_k . y / 4 l^2; for a point each
// gamma_k is larger by 1/4. Products of two such sums are quadratic forms. If the parent is the world its
// vectors are constants and the form is linear.
#pragma once

#include <array>
#include <vector>

#include "magshell/assembly/system_matrix.h"
#include "magshell/core/types.h"

namespace magshell {

/// A linear combination w . X of corners, plus a constant vector.
struct CornerSum {
    Eigen::Matrix<double, 8, 1> weights = Eigen::Matrix<double, 8, 1>::Zero();
    Vec3 fixed = Vec3::Zero();

    friend CornerSum operator-(CornerSum a, const CornerSum& b) {
        a.weights -= b.weights;
        a.fixed -= b.fixed;
        return a;
    }
};

struct CornerForm {
    using Corners = Eigen::Matrix<double, 3, 8>;

    Eigen::Matrix<double, 8, 8> pairs = Eigen::Matrix<double, 8, 8>::Zero();
    Corners linear = Corners::Zero();
    double constant = 0.0;

    /// Adds the scalar product of two sums.
    void add(const CornerSum& a, const CornerSum& b, double factor = 1.0) {
        pairs += factor * (a.weights * b.weights.transpose() + b.weights * a.weights.transpose());
        linear += factor * (a.fixed * b.weights.transpose() + b.fixed * a.weights.transpose());
        constant += factor * a.fixed.dot(b.fixed);
    }
    Corners gradient(const Corners& x) const { return x * pairs + linear; }
    double value(const Corners& x) const { return 0.5 * inner(x * pairs, x) + inner(linear, x) + constant; }
    /// Returns sum_ij a_ij b_ij. It is computed column by column, because GCC warns about Eigen's code for the
    /// whole sum with AVX-512.
    static double inner(const Corners& a, const Corners& b) {
        double sum = 0.0;
        for (int k = 0; k < 8; ++k) sum += a.col(k).dot(b.col(k));
        return sum;
    }
};

/// The corners of two links, or of one link and the world, among all degrees of freedom.
class LinkPair {
  public:
    LinkPair() = default;
    /// Creates the pair. parent: nullptr for the world. rest: reference positions of all nodes.
    LinkPair(const Index* parent, const Index* child, const std::vector<Vec3>& rest,
             const SystemMatrix& matrix);

    /// Express a vector or a point fixed to the parent or the child, given in the reference configuration, by
    /// the corners.
    CornerSum vector(bool of_child, const Vec3& at_rest) const;
    CornerSum point(bool of_child, const Vec3& at_rest) const;

    /// positions() returns the corners relative to one of them, which loses no digits far from the origin: sums
    /// with zero total weight do not depend on the origin. Corners of a link whose parent is the world are
    /// returned unchanged.
    CornerForm::Corners positions(const double* q) const;
    CornerForm::Corners gather(const double* all) const;
    template <class Out>
    void scatter(const CornerForm::Corners& vectors, Out& out) const {
        for (int k = first_; k < 8; ++k)
            for (int c = 0; c < 3; ++c) out.add(3 * nodes_[k] + c, vectors(c, k));
    }
    void add_to(const CornerForm::Corners& vectors, VectorXd& out) const {
        for (int k = first_; k < 8; ++k) out.segment<3>(3 * nodes_[k]) += vectors.col(k);
    }
    /// Adds the blocks h_kl I + factor a_k a_l^T + cross (a_k b_l^T + b_k a_l^T) to the matrix.
    void add(const Eigen::Matrix<double, 8, 8>& h, const CornerForm::Corners& a, double factor,
             const CornerForm::Corners& b, double cross, SystemMatrix& out) const;

    /// rest() returns the reference positions; reach() their largest coordinate [m]; length() the smaller l of
    /// the two links [m].
    const CornerForm::Corners& rest() const { return rest_; }
    double reach() const { return rest_.cwiseAbs().maxCoeff(); }
    double length() const;

  private:
    bool world() const { return first_ == 4; }

    int first_ = 0;  // first of the eight corners in use
    std::array<Index, 8> nodes_{};
    std::array<Vec3, 8> offsets_{};  // rho / 4 l^2
    std::array<Vec3, 2> middle_{};
    CornerForm::Corners rest_ = CornerForm::Corners::Zero();
    std::array<std::array<SystemMatrix::Slot, 8>, 8> slots_{};  // lower triangle
};

}  // namespace magshell
