// Adds the update a front leaves behind to its parent's front ("extend-add").
#pragma once

#include "magshell/linalg/assembly_plan.h"
#include "magshell/linalg/slabs.h"

namespace magshell {

/// The part of a child's update that falls on the parent's pivot columns. `work` is the space that the update
/// lies in.
void add_to_panel(const AssemblyPlan& plan, Index child, double* work, const slabs::Panel& parent);

/// The rest, which falls on the update the parent itself leaves behind.
void add_to_update(const AssemblyPlan& plan, Index child, double* work, const slabs::Triangle& parent);

}  // namespace magshell
