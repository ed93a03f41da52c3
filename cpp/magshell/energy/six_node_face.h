// SixNodeFace: the constant stiffness C of the strain measures of a quadratic triangle, from its reference
// shape, which may be curved, and its material. Element: second-order Hellan-Herrmann-Johnson shell with Regge
// membrane strains (Neunteufel and Schoeberl 2019, 2021).
//
//   membrane  d[3 i + k]: the change of |dx/dt_i|^2 at the two Gauss points of edge i and (k = 2) its mean over the face.
//             Green's strain along t_i is half the linear function with these three numbers: Regge's interpolation.
//   bending   d[3 i + k]: the curvature tested with moments tau = psi_k T_i, T_i = - sym(t_j (x) t_k) / J^2, which have a
//             normal component on edge i only; scaled so that d[3 i + k] is the angle between normal and director at Gauss
//             point k plus the contribution of the curvature inside the face. C is the inverse of the moments' compliance.
#pragma once

#include <array>

#include "magshell/core/types.h"
#include "magshell/energy/material.h"

namespace magshell {

using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Returns the matrix that maps the membrane measures to twice the strain along each t_i at a point.
Eigen::Matrix<double, 3, 9> membrane_interpolation(const std::array<double, 3>& at);

class SixNodeFace {
  public:
    explicit SixNodeFace(std::array<Vec3, 6> rest);
    /// Creates the face from its tangents at the interior points.
    SixNodeFace(const std::array<std::array<Vec3, 3>, 6>& tangents, const std::array<double, 9>& scale);

    Mat9 membrane_stiffness(const ShellMaterial& m) const;
    Mat9 membrane_by_poisson_ratio(const ShellMaterial& m) const;
    Mat9 bending_stiffness(const ShellMaterial& m) const;
    Mat9 bending_by_poisson_ratio(const ShellMaterial& m) const;

    /// At each interior point: 1/J, with J twice the area of the tangent triangle there.
    std::array<double, 6> inverse_jacobian;
    /// Factor of the tested curvature in bending measure 3 i + k.
    std::array<double, 9> scale;
    double area = 0.0;

    /// Returns the values of the moments' test functions at a point, without their directions.
    std::array<double, 9> tests(const std::array<double, 3>& at) const;

  private:
    std::array<std::array<Vec3, 3>, 6> tangents_;  // dx/dt_i at each interior point

    void measure_area();
    template <class Stiffness>
    Mat9 membrane(const Stiffness& at_point) const;
    Mat9 compliance(double factor, double by_products, double by_traces) const;
};

}  // namespace magshell
