// Adds the update of a front to its parent's front ("extend-add").
#pragma once

#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {

/// Adds the part of a child's update that belongs to the parent's pivot columns. `work` is the space that
/// contains the update.
void add_to_panel(const AssemblyPlan& plan, Index child, double* work, const slabs::Panel& parent);

/// Adds the rest, which belongs to the update of the parent itself.
void add_to_update(const AssemblyPlan& plan, Index child, double* work, const slabs::Triangle& parent);

}  // namespace magshell
