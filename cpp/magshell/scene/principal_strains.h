// How much every face of a scene is stretched and bent, in the words of a textbook. Only looks: no term's
// state changes, so it may run beside a solve.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// A row per face of the caller, body after body: the two principal values of
///
///   Green's strain of the middle surface        E = 1/2 (F^T F - I)                                 [1]
///   the bending strain at the outer fibres      h/2 K,  K = sum_i delta_i t~_i (x) t~_i / (A~ l~_i)  [1]
///
/// each pair with the larger value first. E is the tensor whose squares make the membrane energy, [Chen22]
/// (18), and K that of the bending energy, (19): the change of curvature, without the curvature scale.
/// Where a sheet has grown, from its faces as they would be by themselves.
/// Stretch is measured on the triangles on which the membrane energy measures it (body/membrane_faces.h).
using PrincipalStrains = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Sheets of six-node faces follow the others, four rows a face: at the middles of its flat triangles.
/// thickness [m]: per row.
PrincipalStrains principal_strains(const Model& model, const VectorXd& q, const VectorXd& thickness);

/// The largest magnitudes among them, and the caller's numbers of the faces that have them.
struct LargestStrains {
    double membrane = 0.0, bending = 0.0;
    Index membrane_face = 0, bending_face = 0;
};
LargestStrains largest_of(const PrincipalStrains& strains);

}  // namespace magshell
