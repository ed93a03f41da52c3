// The basic types of the core. All quantities are in SI units (lengths in m), in double precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "magshell/core/small_matrices.h"

namespace magshell {

using Index =
    std::int32_t;  // of vertices, faces, dofs and matrix entries; 2^31 is far beyond what fits in memory here
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using VectorXd = Eigen::VectorXd;

// Rows of three numbers, one per vertex or face, in C order like numpy arrays.
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace magshell
