// Strain, curvature, membrane force and bending moment of every face of a shell, as tensors. It only reads the model.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// The tensors of one face, in world axes of the reference configuration; symmetric, and zero along the normal:
///
///   green      E = 1/2 (F^T F - I) of the middle surface                                    [1]
///   curvature  K, the change of curvature since rest, without the curvature scale           [1/m]
///   force      N, with A~ N : dE the change of the membrane energy                          [N/m]
///   moment     M, with A~ M : dK the change of the bending energy                           [N]
///
/// With growth they are measured from the stress-free configuration of the face, with its area A~. E and N are those of the triangle used
/// by the membrane energy (body/membrane_faces.h).
struct FaceStress {
    Mat3 green, curvature, force, moment;
};

/// Returns a row per face in the numbering of the caller, with the stresses for the current parameters. shell: index of
/// Bodies::shells(), or after them of Bodies::six_node_shells(), which have four rows per face, at the middles of its flat triangles
/// (scene/six_node_stresses.h).
std::vector<FaceStress> shell_stresses(const Model& model, Index shell, const VectorXd& q);

}  // namespace magshell
