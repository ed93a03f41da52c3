// LoadedPart: the part of a linear system that forces act on. A matrix may consist of parts that no nonzero
// entry couples, such as bending and stretching of a flat shell; the loaded part can then be solved alone, and
// the solution is zero elsewhere.
#pragma once

#include <span>

#include "magshell/linalg/factor.h"

namespace magshell {

/// The submatrix of some unknowns of a symmetric matrix, without pairs of nodes whose entries are all zero.
/// Single zeros stay, so that unknowns with the same pattern, such as those of a node, are ordered as one.
struct LoadedPart {
    std::vector<Index> unknowns;  // ascending
    SparsePattern pattern;
    std::vector<double> values;
};

/// Returns the part that chains of nonzero entries couple with a nonzero force; the whole matrix if there is no
/// force. Throws InvalidInput if a value is NaN or infinite.
LoadedPart loaded_part(const SparsePattern& pattern, std::span<const double> values, const VectorXd& forces);

}  // namespace magshell
