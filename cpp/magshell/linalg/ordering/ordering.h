// Choice of the fill-reducing ordering of a matrix.
#pragma once

#include "magshell/linalg/multifrontal/assembly_tree.h"

namespace magshell {

/// Returns the assembly tree of a fill-reducing ordering. Throws InvalidInput for Ordering::metis if magshell
/// was built without it.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, const FactorOptions& options);

}  // namespace magshell
