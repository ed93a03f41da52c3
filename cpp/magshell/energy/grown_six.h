// GrownSix: the natural (stress-free) configuration of a quadratic triangle with growth G and natural curvature
// K. It corresponds to energy/grown_face.h, at the points of energy/six_node_face.h.
//
// Growth and curvature are given in axes of the plane through the corners. At other points of the face they
// hold in axes that follow the tangent plane: the projection of the first axis, and the direction perpendicular
// to it. det G is therefore one number per face, and
//
//   stretch    measured from |G t~|^2, where |t~|^2 is the reference value
//   bending    f'[r] = s'_r/(s_r det G) f[r] inside the face, angles unchanged; measured from
//              s'_r/(s_r sqrt(det G)) f~[r] - s'_r sum_p w_p/2 psi_r(p)/(J~ det G) t'_j . K t'_k
//              with f~ the measures of the reference shape, its angles included, and s_r twice the length of edge i at r
#pragma once

#include <cmath>
#include <vector>

#include "magshell/energy/grown_face.h"
#include "magshell/energy/six_node_face.h"

namespace magshell {

using Vec9 = Eigen::Vector<double, 9>;

/// A point of the reference face: t~_0, t~_1, t~_2 in axes of its tangent plane, and these axes.
struct TangentPoint {
    std::array<Eigen::Vector2d, 3> along;
    Eigen::Matrix<double, 3, 2> axes;

    TangentPoint(const std::array<Vec3, 6>& rest, const Vec3& first_axis, const std::array<double, 3>& at);
};

class GrownSix {
  public:
    /// Creates the configuration; arguments as in GrownFace.
    GrownSix(const std::array<Vec3, 6>& rest, const Mat3& growth, const Mat3& curvature);

    SixNodeFace face() const;
    /// Returns the natural values of the membrane measures.
    Vec9 squared_lengths() const;
    /// Return the two parts of the natural bending measures (see above): the factors of the reference measures f~, and the measures
    /// that the natural curvature K causes.
    Vec9 reference_factors() const { return length_ratio_ / std::sqrt(determinant_); }
    Vec9 curvature_measures() const;
    /// Returns the grown vectors t_i at a point, in world axes.
    std::array<Vec3, 3> grown_tangents(const std::array<double, 3>& at) const;

    /// Return the gradient of the work r . C d with respect to growth, for fixed strains r and d.
    Mat2 membrane_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const;
    Mat2 bending_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const;
    /// Return gradients with respect to growth: of by . squared_lengths(); of by . f' for a fixed shape, where `interior` is f'; and, with
    /// the gradient with respect to curvature, of by . (f~ reference_factors() + curvature_measures()).
    Mat2 lengths_by_growth(const Vec9& by) const;
    Mat2 interior_by_growth(const Vec9& by, const Vec9& interior) const;
    GrownFace::ByNatural natural_by_growth(const Vec9& by, const Vec9& rest) const;

    Mat3 in_world(const Mat2& tensor) const { return axes_ * tensor * axes_.transpose(); }

    // The parts of the configuration: energy/grown_six_rest.h differentiates them with respect to the reference shape.
    const std::array<Vec3, 6>& rest() const { return rest_; }
    const Eigen::Matrix<double, 3, 2>& axes() const { return axes_; }
    const Mat2& growth() const { return growth_; }
    const Mat2& curvature() const { return curvature_; }
    double determinant() const { return determinant_; }
    const std::vector<TangentPoint>& interior_points() const { return interior_points_; }
    const std::vector<TangentPoint>& at_gauss() const { return at_gauss_; }
    const std::vector<TangentPoint>& at_middle() const { return at_middle_; }
    /// Return the barycentric coordinates of Gauss point g of edge i, and of the middle of edge m.
    static std::array<double, 3> gauss_point(int i, int g);
    static std::array<double, 3> middle_point(int m);
    /// Returns the factor of t'_j . K t'_k at interior point p in curvature_measures()[r].
    double curvature_weight(int r, int p) const;
    /// Returns the derivative of r_ . S d_ at an interior point by a homogeneous deformation of the grown tangents there.
    Mat2 compliance_by_deformation(const ShellMaterial& m, int p, const Vec9& of_r, const Vec9& of_d) const;

  private:
    /// The moments of r_ and d_ at an interior point, and their strains times the area that the point stands for.
    struct Moments {
        Mat2 of_r, of_d, strain_r, strain_d;
    };
    Moments moments(const ShellMaterial& m, int p, const Vec9& of_r, const Vec9& of_d) const;
    /// Returns J' at an interior point.
    double jacobian(int p) const;
    /// Returns the gradient of by_logarithm . log(length_ratio_) with respect to growth.
    Mat2 length_ratio_by_growth(const Vec9& by_logarithm) const;

    std::array<Vec3, 6> rest_;
    Eigen::Matrix<double, 3, 2> axes_;
    Mat2 growth_, inverse_, curvature_;
    double determinant_;
    // The six integration points; Gauss points 2 i + g of the edges, where only t_i is used; the middles of the three edges.
    std::vector<TangentPoint> interior_points_, at_gauss_, at_middle_;
    Vec9
        length_ratio_;  // s'_r / s_r, the ratio of edge lengths after and before growth; 1 where r is no point of an edge
    Vec9 scale_;  // s'
};

}  // namespace magshell
