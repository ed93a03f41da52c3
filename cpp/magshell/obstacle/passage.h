// Tests whether a point passes through an obstacle, or a face over the middle of one, all in the obstacle's own frame.
#pragma once

#include <array>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// Returns true if the straight way leads through the middle surface of a body, where the normal jumps from one side to the other. The body
/// is thicker on all sides by a radius [m], that of a ball whose center takes this way.
bool passes_through(const Obstacle& shape, const Vec3& from, const Vec3& to, double radius = 0.0);

/// Returns true if a triangle whose corners move on straight lines sweeps over a point.
bool sweeps_over(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to, const Vec3& point);

}  // namespace magshell
