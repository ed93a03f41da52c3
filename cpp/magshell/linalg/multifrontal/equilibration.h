// Scaling of a symmetric matrix so that its rows are of similar size, whatever the units of its unknowns.
#pragma once

#include <vector>

#include "magshell/core/large_memory.h"
#include "magshell/linalg/factor.h"

namespace magshell {

/// Replaces A by S A S with a diagonal S of powers of two, so that scaling causes no round-off. The largest
/// entry of most rows of the result is between 1/4 and 4. Returns the largest entry of all. Throws InvalidInput
/// if a value is not finite.
double equilibrate(const SparsePattern& pattern, LargeVector<double>& values, std::vector<double>& scale);

/// Replaces an equilibrated S A S in the same way until the largest entry of every row is between 1/2 and 4,
/// and multiplies `scale` accordingly. Returns the largest entry of all.
double equilibrate_further(const SparsePattern& pattern, LargeVector<double>& values,
                           std::vector<double>& scale);

}  // namespace magshell
