// Strain, curvature, membrane force and bending moment of six-node shells. It only reads the model.
#pragma once

#include "magshell/scene/shell_stresses.h"

namespace magshell {

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
