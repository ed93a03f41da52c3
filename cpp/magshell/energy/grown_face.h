// A flat face that has grown: what it would be by itself, in axes of its plane at rest.
//
//   edges      t'_i = G t~_i, area A' = A~ det G, so that C is that of the grown triangle (energy/material.h)
//   stretch    measured from |t'_i|^2
//   bending    measured from  b = sqrt(det G) b~ + G K G  in axes at rest: the curvature of the rest shape b~, so that an even
//              growth leaves its angles as they are, and K in axes of the grown face. As angles of edges, with alpha~_i
//              that of the rest shape,
//              o_i = alpha~_i (l'_i / (l~_i sqrt(det G)) - 1) - l'_i / (4 A') t'_j . K t'_k
//
// In derivatives by G, sym(a (x) b) is that of a . G b.
#pragma once

#include <array>

#include "magshell/energy/material.h"

namespace magshell {

using Mat2 = Eigen::Matrix2d;

inline Mat2 symmetric_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return 0.5 * (a * b.transpose() + b * a.transpose());
}

/// The stiffness of a grown triangle, and how the work r . C d of two strains goes with its growth.
class GrownTriangle {
  public:
    GrownTriangle(const std::array<Eigen::Vector2d, 3>& edges, const Mat2& growth)
        : edge(edges),
          grown{growth * edges[0], growth * edges[1], growth * edges[2]},
          inverse(growth.inverse()),
          determinant(growth.determinant()),
          face(grown) {}

    Mat2 membrane_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const;
    Mat2 bending_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const;
    /// d|t'_i|^2 and, over l'_i, dl'_i.
    Mat2 squared_length_by_growth(int i) const { return 2.0 * symmetric_product(grown[i], edge[i]); }
    Mat2 relative_length_by_growth(int i) const {
        return symmetric_product(grown[i], edge[i]) / grown[i].squaredNorm();
    }

    std::array<Eigen::Vector2d, 3> edge, grown;
    Mat2 inverse;
    double determinant;
    RestFace face;

  private:
    struct Work;
    Work work(const std::array<Mat2, 3>& measures, double modulus, double nu, const Vec3& r,
              const Vec3& d) const;
};

class GrownFace {
  public:
    /// growth and curvature [1/m] as symmetric tensors in world axes: what of them lies in the face counts.
    GrownFace(const std::array<Vec3, 3>& rest, const Mat3& growth, const Mat3& curvature);

    const RestFace& face() const { return triangle_.face; }
    const GrownTriangle& triangle() const { return triangle_; }
    /// In its plane.
    std::array<Vec3, 3> corners() const;
    Vec3 squared_lengths() const;
    /// o_i [rad], over the angles of the rest shape.
    Vec3 natural_angle_changes(const Vec3& rest_angles) const;

    /// Of by . |t'|^2.
    Mat2 lengths_by_growth(const Vec3& by) const;
    struct ByNatural {
        Mat2 growth, curvature;
    };
    /// Of by . o.
    ByNatural natural_angle_changes_vjp(const Vec3& rest_angles, const Vec3& by) const;

    /// A derivative in the face's axes as one by a tensor in world axes.
    Mat3 in_world(const Mat2& tensor) const { return axes_ * tensor * axes_.transpose(); }

  private:
    Eigen::Matrix<double, 3, 2> axes_;
    GrownTriangle triangle_;
    Mat2 curvature_;
};

}  // namespace magshell
