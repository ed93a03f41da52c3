// GrownFace: the natural (stress-free) configuration of a flat face with a growth tensor G and a natural
// curvature K, in axes of its plane in the reference configuration.
//
//   edges      t'_i = G t~_i, area A' = A~ det G; the stiffness C is that of the grown triangle (energy/material.h)
//   stretch    measured from |t'_i|^2
//   bending    measured from  b = sqrt(det G) b~ + G K G  in reference axes, with the curvature b~ of the reference shape, so that
//              uniform growth does not change its angles; K is in axes of the grown face. As an angle at edge i, with the
//              reference angle alpha~_i,
//              o_i = alpha~_i (l'_i / (l~_i sqrt(det G)) - 1) - l'_i / (4 A') t'_j . K t'_k
//
// In derivatives with respect to G, sym(a (x) b) is the derivative of a . G b.
#pragma once

#include <array>
#include <cmath>

#include "magshell/energy/material.h"

namespace magshell {

using Mat2 = Eigen::Matrix2d;

inline Mat2 symmetric_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return 0.5 * (a * b.transpose() + b * a.transpose());
}

/// A grown triangle, and the derivatives of the work r . C d of two strains by its growth.
class GrownTriangle {
  public:
    GrownTriangle(const std::array<Eigen::Vector2d, 3>& edges, const Mat2& growth)
        : edge(edges),
          growth(growth),
          grown{growth * edges[0], growth * edges[1], growth * edges[2]},
          inverse(growth.inverse()),
          determinant(growth.determinant()),
          face(grown) {}

    Mat2 membrane_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const;
    Mat2 bending_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const;
    /// Returns the derivative with respect to G of |t'_i|^2; relative_length_by_growth() that of l'_i, divided by l'_i.
    Mat2 squared_length_by_growth(int i) const { return 2.0 * symmetric_product(grown[i], edge[i]); }
    /// Returns the gradient of by . |t'|^2 by growth.
    Mat2 lengths_by_growth(const Vec3& by) const {
        Mat2 sum = Mat2::Zero();
        for (int i = 0; i < 3; ++i) sum += by[i] * squared_length_by_growth(i);
        return sum;
    }
    Mat2 relative_length_by_growth(int i) const {
        return symmetric_product(grown[i], edge[i]) / grown[i].squaredNorm();
    }

    /// Returns the same natural triangle with itself as reference shape: derivatives with respect to its growth are those by a homogeneous
    /// deformation of the natural shape. from_natural() converts one of these to that by a deformation of the reference shape, G S G^-1.
    GrownTriangle natural() const { return {grown, Mat2::Identity()}; }
    Mat2 from_natural(const Mat2& by) const { return growth * by * inverse; }

    std::array<Eigen::Vector2d, 3> edge;
    Mat2 growth;
    std::array<Eigen::Vector2d, 3> grown;
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
    /// Creates the configuration. growth [-] and curvature [1/m] are symmetric tensors in world axes; only
    /// their components in the plane of the face matter.
    GrownFace(const std::array<Vec3, 3>& rest, const Mat3& growth, const Mat3& curvature);

    const RestFace& face() const { return triangle_.face; }
    const GrownTriangle& triangle() const { return triangle_; }
    /// Returns the corners in the plane of the face.
    std::array<Vec3, 3> corners() const;
    Vec3 squared_lengths() const;
    /// Returns o_i [rad], the natural angles relative to those of the reference shape.
    Vec3 natural_angle_changes(const Vec3& rest_angles) const;

    struct ByNatural {
        Mat2 growth, curvature;
    };
    /// Returns the gradient of by . o by growth and curvature.
    ByNatural natural_angle_changes_vjp(const Vec3& rest_angles, const Vec3& by) const;
    struct ByRest {
        Mat2 deformation;
        Vec3 angles;
    };
    /// Returns the gradient of by . o by a homogeneous deformation of the reference shape in its plane, and by its angles.
    ByRest natural_angle_changes_by_rest(const Vec3& rest_angles, const Vec3& by) const;

    /// Converts a derivative in axes of the face to one by a tensor in world axes.
    Mat3 in_world(const Mat2& tensor) const { return axes_ * tensor * axes_.transpose(); }

  private:
    /// Returns l'_i / (l~_i sqrt(det G)).
    double lengthened(int i) const {
        return face().edge_length[i] / (triangle_.edge[i].norm() * std::sqrt(triangle_.determinant));
    }

    Eigen::Matrix<double, 3, 2> axes_;
    GrownTriangle triangle_;
    Mat2 curvature_;
};

}  // namespace magshell
