// Continuous collision detection: how far the nodes of a pair may move along straight paths before the pair
// comes too close.
//
// Two convex parts are at least as far apart as their projections on any direction n, and along a fixed n
// projections change linearly on straight paths. With n along the closest points, the path is free up to where
// the first corner of one part comes too close, along n, to a corner of the other. From there the argument is
// repeated until little of the gap is left. Tangential sliding costs nothing, because it does not change
// projections on n; additive continuous collision detection (Li et al. 2021), which bounds all motion by its
// length, is never less restrictive.
//
// The result is safe for any choice of n, so the closest points need not be exact: the bound uses the products
// n . (x_i - x_j) only. Their round-off is subtracted from the gap.
#pragma once

#include "magshell/contact/proximity.h"

namespace magshell {

/// Returns a fraction in [0, 1] of the path from `from` to `to` on which the distance of the pair minus
/// `thickness` [m] stays above `keep` (in [0, 1)) times its initial value; 0 if there is no gap initially, and
/// 1 only if the whole path is free. The fraction is never too large. It is too small by a few hundredths of
/// the gap at most, unless the gap is of the size of round-off.
double collision_free_step(PairKind kind, const PairPositions& from, const PairPositions& to,
                           double thickness, double keep);

}  // namespace magshell
