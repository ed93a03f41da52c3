// Strain, curvature, membrane force and bending moment of every face of a sheet, as tensors. Only looks.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// Of one face at rest, in world axes; symmetric, and zero along the normal.
///
///   green      E = 1/2 (F^T F - I) of the middle surface                                    [1]
///   curvature  K, the change of curvature since rest, without the curvature scale           [1/m]
///   force      N, with A~ N : dE the change of the membrane energy                          [N/m]
///   moment     M, with A~ M : dK the change of the bending energy                           [N]
///
/// Where a sheet has grown, all this is since the face was as it would be by itself, and A~ its area then.
/// E and N are of the triangle on which the membrane energy measures stretch (body/membrane_faces.h).
struct FaceStress {
    Mat3 green, curvature, force, moment;
};

/// A row per face of the caller, with the elastic stresses of the values that the model has. sheet: which of
/// Bodies::sheets(), or after them of Bodies::six_node_sheets(): of those four rows a face, at the middles of its four flat
/// triangles (scene/six_node_stresses.h).
std::vector<FaceStress> sheet_stresses(const Model& model, Index sheet, const VectorXd& q);

}  // namespace magshell
