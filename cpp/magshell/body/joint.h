// The joint between a link of a skeleton and its parent.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

enum class JointKind {
    free,       // six degrees of freedom
    fixed,      // none
    revolute,   // rotates about the axis
    prismatic,  // translates along the axis
    ball        // rotates about the origin
};

/// A joint. Origin and axis are in world coordinates of the reference configuration; the axis is a unit vector, zero without one. A ball
/// joint may have an axis, that of a cone which limits its rotation.
struct Joint {
    JointKind kind = JointKind::free;
    Index parent = -1;  // index of an earlier link of the same skeleton; negative: the world
    Vec3 origin = Vec3::Zero(), axis = Vec3::Zero();
    bool has_motor = false;  // a motor prescribes its coordinate or rotation
    bool damped = false;     // a damper acts in it
    bool twisted = false;    // a ball joint with an applied moment
    bool served = false;     // a ball joint with a servo
    bool coned = false;      // a ball joint whose axis is limited to a cone

    bool has_axis() const { return kind == JointKind::revolute || kind == JointKind::prismatic; }
    /// Returns its number of degrees of freedom.
    Index freedom() const {
        switch (kind) {
            case JointKind::free:
                return 6;
            case JointKind::ball:
                return 3;
            case JointKind::fixed:
                return 0;
            default:
                return 1;
        }
    }
};

}  // namespace magshell
