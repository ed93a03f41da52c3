// A six-node face that has grown: what it would be by itself. As energy/grown_face.h, at the points of energy/six_node_face.h.
//
// Growth and curvature are given in axes of the plane through the corners, and hold along the face in axes that follow its
// tangent plane: the first one's projection, and across it. So det G is one number, and
//
//   stretch    measured from |G t~|^2 where |t~|^2 is at rest
//   bending    f'[r] = s'_r/(s_r det G) f[r] inside, angles as they are; measured from
//              s'_r/(s_r sqrt(det G)) f~[r] - s'_r sum_p w_p/2 psi_r(p)/(J~ det G) t'_j . K t'_k
//              with f~ what the rest shape measures, its angles included, and s_r twice the length of edge i at r
#pragma once

#include <cmath>
#include <vector>

#include "magshell/energy/grown_face.h"
#include "magshell/energy/six_node_face.h"

namespace magshell {

using Vec9 = Eigen::Vector<double, 9>;

/// A point of the face at rest: t~_0, t~_1, t~_2 in axes of its tangent plane, and these.
struct TangentPoint {
    std::array<Eigen::Vector2d, 3> along;
    Eigen::Matrix<double, 3, 2> axes;

    TangentPoint(const std::array<Vec3, 6>& rest, const Vec3& first_axis, const std::array<double, 3>& at);
};

class GrownSix {
  public:
    /// As GrownFace.
    GrownSix(const std::array<Vec3, 6>& rest, const Mat3& growth, const Mat3& curvature);

    SixNodeFace face() const;
    /// Of membrane measures.
    Vec9 squared_lengths() const;
    /// What of f~ the bending is measured from, and what beside it.
    Vec9 rest() const { return lengthened_ / std::sqrt(determinant_); }
    Vec9 bent() const;
    /// t_i at a point of the face at rest, grown, in world axes.
    std::array<Vec3, 3> grown_tangents(const std::array<double, 3>& at) const;

    /// Of r . C d, with C of the face and r, d fixed.
    Mat2 membrane_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const;
    Mat2 bending_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const;
    /// Of by . squared_lengths; of by . f' in a fixed shape, f' as it is; and of by . (f~ rest + bent).
    Mat2 lengths_by_growth(const Vec9& by) const;
    Mat2 inside_by_growth(const Vec9& by, const Vec9& inside) const;
    GrownFace::ByNatural natural_by_growth(const Vec9& by, const Vec9& rest) const;

    Mat3 in_world(const Mat2& tensor) const { return axes_ * tensor * axes_.transpose(); }

  private:
    Mat2 lengthened_by_growth(const Vec9& by_logarithm) const;

    std::array<Vec3, 6> rest_;
    Eigen::Matrix<double, 3, 2> axes_;
    Mat2 growth_, inverse_, curvature_;
    double determinant_;
    std::vector<TangentPoint> inside_, at_gauss_, at_middle_;  // 6; 3 i + g: only t_i counts; 3
    Vec9 lengthened_, scale_;                                  // scale_: s'
};

}  // namespace magshell
