// A matrix may fall into parts that no entry other than zero couples, as bending and stretching of a flat sheet: the one that
// forces act on can be solved by itself, and nothing answers elsewhere.
#pragma once

#include <span>

#include "magshell/linalg/factor.h"

namespace magshell {

/// A symmetric matrix of some of the unknowns of another one, without pairs of nodes between which all is zero. Single zeros
/// stay: unknowns that have the same pattern, as those of a node, are ordered as one.
struct LoadedPart {
    std::vector<Index> unknowns;  // ascending
    SparsePattern pattern;
    std::vector<double> values;
};

/// What chains of entries other than zero couple with a force other than zero; all of the matrix where there is no force.
/// Throws InvalidInput on NaN or infinity among the values.
LoadedPart loaded_part(const SparsePattern& pattern, std::span<const double> values, const VectorXd& forces);

}  // namespace magshell
