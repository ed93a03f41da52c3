// Fill-reducing orderings.
#pragma once

#include <string>
#include <vector>

#include "magshell/linalg/assembly_tree.h"

namespace magshell {

/// order[k] = the unknown to eliminate k-th. AMD always works; METIS only where CHOLMOD was built with it (without it,
/// AMD is used).
std::vector<Index> fill_reducing_order(const SparsePattern& pattern, Ordering ordering);

/// The assembly tree for the ordering asked for; for Ordering::best, of the one that needs fewer operations.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, Ordering ordering);

}  // namespace magshell
