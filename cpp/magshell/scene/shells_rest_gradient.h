// The gradient of the elastic energies of three-node shells by rest positions.
//
// A face takes from its rest shape its strain measures M_i and their stiffness C, so that for fixed strains r and d, of which r is the rate
// along lambda, r . C d = e(r) : s(d) with e = sum_i r_i M_i and the stress s, C_ij r_i d_j = A~ M_i : c : M_j r_i d_j. A homogeneous
// deformation I + H of the rest shape in its plane turns M_i into (I - H^T) M_i (I - H), up to lengths of edges, and A~ into A~ (1 + tr H):
//
//   d(r . C d) = B : H,   B = (e(r) : s(d)) I - 2 sym(e(r) s(d) + e(d) s(r)) + ...         dW/dX_k = B g_k   (energy/rest_corners.h)
//
// The reference lengths and dihedral angles, from which d is measured, follow X besides.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// Returns d(lambda . g)/dX of the membrane and bending energies at the last evaluated state q: three numbers per node, of rest positions of
/// vertices and of directions. curvature_scales: per three-node shell, one number per edge of the caller. Without strain history and growth;
/// triangles that consist of two faces must have one material.
VectorXd shells_rest_vjp(Model& model, const VectorXd& q, const VectorXd& lambda,
                         const std::vector<VectorXd>& curvature_scales);

}  // namespace magshell
