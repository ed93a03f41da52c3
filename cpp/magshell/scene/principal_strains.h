// Principal membrane and bending strains of every face of a scene. It only reads the model, so it may run beside a solve.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// The strains, with a row per face in the numbering of the caller, body after body: the two principal values of
///
///   Green's strain of the middle surface        E = 1/2 (F^T F - I)                                 [1]
///   the bending strain at the outer fibres      h/2 K,  K = sum_i delta_i t~_i (x) t~_i / (A~ l~_i)  [1]
///
/// each pair with the larger value first. E is the tensor of the membrane energy, [Chen22] (18), and K that of the bending energy, (19): the
/// change of curvature, without the curvature scale. With growth, both are measured from the stress-free configuration of each face.
/// E is that of the triangles used by the membrane energy (body/membrane_faces.h).
using PrincipalStrains = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Returns the strains. Six-node shells follow the others, with four rows per face, at the middles of its flat triangles.
/// thickness: per row [m].
PrincipalStrains principal_strains(const Model& model, const VectorXd& q, const VectorXd& thickness);

/// The largest magnitudes of the strains, and the faces that have them, in the numbering of the caller.
struct LargestStrains {
    double membrane = 0.0, bending = 0.0;
    Index membrane_face = 0, bending_face = 0;
};
LargestStrains largest_of(const PrincipalStrains& strains);

}  // namespace magshell
