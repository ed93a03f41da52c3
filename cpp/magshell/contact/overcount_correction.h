// What takes back that a point near several triangles of one surface is counted with each.     contact/broad_phase.h
#pragma once

#include <vector>

#include "magshell/contact/near_pair.h"

namespace magshell {

/// Adds to `all`, for the pairs of a point and a triangle from `first` on, those of the same points with the edges and
/// vertices that these triangles share, as far as they are nearer than `margin` [m] with nodes at q. Pairs of one point
/// stand together.
void add_overcount_corrections(std::size_t first, const double* q, double margin, std::vector<NearPair>& all);

}  // namespace magshell
