// Strain, curvature, membrane force and bending moment in sheets of six-node faces. Only looks.
#pragma once

#include "magshell/scene/sheet_stresses.h"

namespace magshell {

/// At the middles of the four flat triangles of every face of the caller, 4 f to 4 f + 3: those at corners 0, 1, 2, then the
/// one between the middle nodes. Symmetric, in world axes, zero along the normal there.
struct SixNodeStrain {
    Mat3 green, curvature;
};

/// Of the strains alone, which the materials have no part in. sheet: which of Bodies::six_node_sheets().
std::vector<SixNodeStrain> six_node_strains(const Model& model, Index sheet, const VectorXd& q);

/// With the stresses of the values that the model has.
std::vector<FaceStress> six_node_stresses(const Model& model, Index sheet, const VectorXd& q);

/// The two principal values in the plane, the larger first, of a tensor that is zero along its normal.
Eigen::Vector2d principal_in_plane(const Mat3& tensor);

}  // namespace magshell
