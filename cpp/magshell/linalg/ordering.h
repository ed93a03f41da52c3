// Fill-reducing orderings.
#pragma once

#include "magshell/linalg/assembly_tree.h"

namespace magshell {

/// The assembly tree for a fill-reducing ordering. Throws InvalidInput for Ordering::metis where magshell was
/// built without it.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, const FactorOptions& options);

}  // namespace magshell
