// Overcount correction of contact pairs: a point near several triangles of one surface would be counted once
// for each (contact/broad_phase.h).
#pragma once

#include <vector>

#include "magshell/contact/near_pair.h"

namespace magshell {

/// Adds correction pairs to `all` for the pairs of a point and a triangle from `first` on: pairs of the same
/// point with the edges and vertices that its triangles share, if they are closer than `margin` [m] with nodes
/// at q. The pairs of one point must be consecutive.
void add_overcount_corrections(std::size_t first, const double* q, double margin, std::vector<NearPair>& all);

}  // namespace magshell
