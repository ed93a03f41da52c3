// Fill-reducing orderings.
#pragma once

#include <functional>

#include "magshell/linalg/assembly_tree.h"

namespace magshell {

/// The assembly tree for a fill-reducing ordering. `points` of the unknowns, or none. Ordering::best is nested
/// dissection; small patterns and those without points are ordered by AMD, too, and the one that needs fewer
/// operations is taken. Throws InvalidInput for Ordering::metis where magshell was built without it.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, Ordering ordering,
                                   const std::vector<Vec3>& points,
                                   const std::function<void()>& watch);

}  // namespace magshell
