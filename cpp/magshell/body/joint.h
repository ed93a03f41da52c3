// What joins a link of a skeleton to the one before it.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

enum class JointKind {
    free,       // moves and turns as it likes
    fixed,      // not at all
    revolute,   // turns about the axis
    prismatic,  // slides along it
    ball        // turns about the origin
};

/// Origin and axis as the world has them at rest; the axis is a unit vector, zero where there is none. A ball joint may have
/// one: that of a cone.
struct Joint {
    JointKind kind = JointKind::free;
    Index parent = -1;  // a link of the same skeleton, before this one; negative: the world
    Vec3 origin = Vec3::Zero(), axis = Vec3::Zero();
    bool driven = false;   // a motor prescribes its coordinate, or its rotation
    bool damped = false;   // a damper acts in it
    bool twisted = false;  // a ball joint with a moment in it
    bool served = false;   // a ball joint with a servo
    bool coned = false;    // a ball joint whose axis has to stay in a cone

    bool has_axis() const { return kind == JointKind::revolute || kind == JointKind::prismatic; }
    /// How many coordinates it has.
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
