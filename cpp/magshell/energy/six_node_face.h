// The constant stiffness C of the strain measures of a six-node face, from its rest shape, which may be curved, and its
// material: the second-order Hellan-Herrmann-Johnson shell with Regge membrane strains (Neunteufel and Schoeberl 2019, 2021).
//
//   membrane  d[3 i + k]: the change of |dx/dt_i|^2 at the two Gauss points of edge i and (k = 2) its mean over the face.
//             Green's strain along t_i is half the linear function with these three numbers: Regge's interpolation.
//   bending   d[3 i + k]: the curvature against test moments tau = psi_k T_i, T_i = - sym(t_j (x) t_k) / J^2, that have a
//             normal component on edge i alone; scaled so that d[3 i + k] is the angle between normal and director at Gauss
//             point k plus what the curvature inside the face is worth there. C is the inverse of the moments' compliance.
#pragma once

#include <array>

#include "magshell/core/types.h"
#include "magshell/energy/material.h"

namespace magshell {

using Mat9 = Eigen::Matrix<double, 9, 9>;

/// The strain along each t_i at a point, doubled, from the membrane's measures.
Eigen::Matrix<double, 3, 9> membrane_interpolation(const std::array<double, 3>& at);

class SixNodeFace {
  public:
    explicit SixNodeFace(std::array<Vec3, 6> rest);
    /// From its tangents at the points inside.
    SixNodeFace(const std::array<std::array<Vec3, 3>, 6>& tangents, const std::array<double, 9>& scale);

    Mat9 membrane_stiffness(const ShellMaterial& m) const;
    Mat9 membrane_by_poisson_ratio(const ShellMaterial& m) const;
    Mat9 bending_stiffness(const ShellMaterial& m) const;
    Mat9 bending_by_poisson_ratio(const ShellMaterial& m) const;

    /// At a point inside: the inverse of J, twice the area of the tangent triangle there.
    std::array<double, 6> inverse_jacobian;
    /// What measure 3 i + k of the bending multiplies its tested curvature by.
    std::array<double, 9> scale;
    double area = 0.0;

    /// What the moments' test functions are at a point, without their directions.
    std::array<double, 9> tests(const std::array<double, 3>& at) const;

  private:
    std::array<std::array<Vec3, 3>, 6> tangents_;  // at each point inside, dx/dt_i

    void measure_area();
    template <class Stiffness>
    Mat9 membrane(const Stiffness& at_point) const;
    Mat9 compliance(double factor, double by_products, double by_traces) const;
};

}  // namespace magshell
