// A matrix may fall into parts that no entry other than zero couples, as bending and stretching of a flat sheet: the one that
// forces act on can be solved by itself, and nothing answers elsewhere.
#pragma once

#include <optional>
#include <span>

#include "magshell/linalg/factor.h"

namespace magshell {

/// A symmetric matrix of some of the unknowns of another one.
struct LoadedPart {
    std::vector<Index> unknowns;  // ascending
    SparsePattern pattern;
    std::vector<double> values;
};

/// What chains of entries other than zero couple with a force other than zero. Nothing where that is the whole matrix, or
/// there is no force. Throws InvalidInput on NaN or infinity among the values.
std::optional<LoadedPart> loaded_part(const SparsePattern& pattern, std::span<const double> values,
                                      const VectorXd& forces);

}  // namespace magshell
