// How far the nodes of a pair may go on straight ways before the pair comes too close.
//
// Two convex parts are no nearer than what is between them along any direction n, and along a direction that
// stands still that changes linearly on straight ways. So from where the way has been found free, with n along
// the closest points there, it is free to where the first corner of one part comes too near, along n, to one of
// the other. Taken again from there until little of the gap is left. Sliding along each other costs nothing, as n
// does not see it; additive continuous collision detection (Li et al. 2021), which bounds all motion by its
// length, is a worse case of this.
//
// What is taken for n does not matter for its being safe, so that no closest point has to be exact: the bound is on
// products n . (x_i - x_j) alone. Differences of coordinates carry a round-off of those, which is taken off the gap.
#pragma once

#include "magshell/contact/proximity.h"

namespace magshell {

/// The largest share found of the way from `from` to `to`, in [0, 1], on all of which what the pair's distance is
/// above `thickness` [m] stays above `keep` (in [0, 1)) times what it is at the beginning. 0 where it is none.
/// 1 only if all of the way is free; never too large, and less than it could be only by a few hundredths of the
/// gap, or where the gap is no more than round-off.
double collision_free_step(PairKind kind, const PairPositions& from, const PairPositions& to,
                           double thickness, double keep);

}  // namespace magshell
