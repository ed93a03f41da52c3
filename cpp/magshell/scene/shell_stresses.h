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
/// (SixNodeStrain).
std::vector<FaceStress> shell_stresses(const Model& model, Index shell, const VectorXd& q);

/// The strains at the middle of a flat triangle of a face. Face f of the caller has rows 4 f to 4 f + 3: the triangles at corners 0, 1, 2, then
/// the one between the middle nodes. Symmetric, in world axes, zero along the normal there.
struct SixNodeStrain {
    Mat3 green, curvature;
};

/// Returns the strains, which do not depend on the materials. shell: index of Bodies::six_node_shells().
std::vector<SixNodeStrain> six_node_strains(const Model& model, Index shell, const VectorXd& q);

/// Returns strains and stresses for the current parameters.
std::vector<FaceStress> six_node_stresses(const Model& model, Index shell, const VectorXd& q);

/// Returns the two principal values in the plane, the larger first, of a tensor that is zero along its normal.
Eigen::Vector2d principal_in_plane(const Mat3& tensor);

}  // namespace magshell
