// The few types every floor shares. Lengths in m, SI throughout, double precision only.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

namespace magshell {

using Index = std::int32_t;  // vertices, faces, unknowns and matrix entries; 2^31 is far beyond what fits in
                             // memory here
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using VectorXd = Eigen::VectorXd;

// A row per vertex or face, C order, as numpy hands it over.
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace magshell
