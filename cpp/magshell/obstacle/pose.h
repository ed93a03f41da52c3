// Where an obstacle has moved from its place: about its center, and how fast it does.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

struct ObstaclePose {
    Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // of its center [m/s]; [rad/s], world axes
};

}  // namespace magshell
