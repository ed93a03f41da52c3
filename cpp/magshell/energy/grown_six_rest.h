// GrownSixRest: the gradient of a function of the natural configuration of a grown quadratic triangle (grown_six.h) by the nodes of its
// reference shape.
//
// The configuration depends on the tangents t_i of the reference shape at the points, in axes (a, b) that follow the tangent plane; on growth
// and natural curvature in the axes of the corners' plane; and on the lengths s~ of edges. With the first edge e, e . n its part along the
// normal n = a x b, and b = beta_0 t_0 + beta_1 t_1,
//
//   d(a . t_i, b . t_i) = (a . dt_i, b . dt_i) + w (b . t_i, - a . t_i)
//   w = b . da = (b . de + (e . n) n . (beta_0 dt_0 + beta_1 dt_1)) / (e . a)
#pragma once

#include "magshell/energy/grown_six.h"

namespace magshell {

class GrownSixRest {
  public:
    explicit GrownSixRest(const GrownSix& face) : face_(face) {}

    /// Add the gradients of: by . squared_lengths(); the work r . C d of the membrane for fixed strains; -r_ . S d_ with the compliance S of the
    /// bending moments r_ = C r and d_ = C d, without the edge lengths s'; the inverse of the grown Jacobian at an interior point.
    void add_lengths(const Vec9& by);
    void add_membrane(const ShellMaterial& m, const Vec9& r, const Vec9& d);
    void add_compliance(const ShellMaterial& m, const Vec9& of_r, const Vec9& of_d);
    void add_inverse_jacobian(int point, double by);
    /// Adds the gradient with respect to the logarithms of s'.
    void add_scale(const Vec9& by_logarithm);
    /// Adds that of by . (f~ reference_factors() + curvature_measures()), for fixed measures f~.
    void add_natural(const Vec9& by, const Vec9& rest);

    /// Returns the gradient with respect to the six nodes. growth, curvature: the tensors in space. by_lengths: receives the gradient with
    /// respect to s~, which is not part of it.
    std::array<Vec3, 6> nodes(const Mat3& growth, const Mat3& curvature, Vec9& by_lengths) const;

  private:
    using Tangents = std::array<Eigen::Vector2d, 3>;
    /// Adds the gradient with respect to grown tangents G t at a point to those with respect to t and G.
    void add_grown(const TangentPoint& point, const Tangents& by_grown, Tangents& by_along);
    /// Adds that for the derivative S with respect to a homogeneous deformation of the grown tangents at an interior point.
    void add_deformation(int point, const Mat2& by);
    void add_length_ratio(const Vec9& by_logarithm);

    const GrownSix& face_;
    std::array<Tangents, 6> by_interior_ = zeros<6>(), by_gauss_ = zeros<6>();
    std::array<Tangents, 3> by_middle_ = zeros<3>();
    Mat2 by_growth_ = Mat2::Zero(), by_curvature_ = Mat2::Zero();
    Vec9 by_log_length_ = Vec9::Zero();  // by log s~

    template <std::size_t N>
    static std::array<Tangents, N> zeros() {
        std::array<Tangents, N> all;
        for (Tangents& each : all) each.fill(Eigen::Vector2d::Zero());
        return all;
    }
};

}  // namespace magshell
