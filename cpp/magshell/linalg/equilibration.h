// Scaling a symmetric matrix so that its rows are of one size, whatever units its unknowns are in.
#pragma once

#include <vector>

#include "magshell/core/large_memory.h"
#include "magshell/linalg/factor.h"

namespace magshell {

/// A <- S A S with S diagonal, its entries powers of two: scaling rounds nothing. The largest entry of each
/// row of the result is between 1/4 and 4 in most rows. Returns the largest of all. Throws InvalidInput when
/// a value is not finite.
double equilibrate(const SparsePattern& pattern, LargeVector<double>& values, std::vector<double>& scale);

}  // namespace magshell
