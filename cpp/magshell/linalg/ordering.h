// Fill-reducing orderings.
#pragma once

#include "magshell/linalg/assembly_tree.h"

namespace magshell {

/// The assembly tree for a fill-reducing ordering. AMD always works; METIS only where CHOLMOD is there and
/// was built with it, else AMD takes its place. Ordering::best tries both where METIS is quick, and takes the
/// one that needs fewer operations.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, Ordering ordering);

}  // namespace magshell
