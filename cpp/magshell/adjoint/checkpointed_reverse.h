// Reverse sweep through a motion with checkpoints: the steps between two checkpoints are repeated, as often as the storage requires
// (revolve, Griewank and Walther 2000).
#pragma once

#include <functional>
#include <utility>

#include "magshell/solve/motion/dynamics.h"

namespace magshell {

class CheckpointedReverse {
  public:
    using Forward = std::function<void(Index begin, Index end, MotionState& state)>;
    using Leaf = std::function<void(Index begin, Index end, const MotionState& state)>;

    /// forward: repeats steps, advancing the state at `begin`. leaf: repeats at most `longest_leaf` steps, storing all of them, and
    /// computes their adjoint.
    CheckpointedReverse(Index longest_leaf, Forward forward, Leaf leaf)
        : longest_(longest_leaf), forward_(std::move(forward)), leaf_(std::move(leaf)) {}

    /// Computes the adjoint of steps begin .. end from the state at begin, with this number of free checkpoints.
    void back(Index begin, Index end, const MotionState& at_begin, Index slots) const {
        if (begin >= end) return;
        const Index ahead = next_checkpoint(end - begin, longest_, slots);
        MotionState state = at_begin;
        if (ahead > 0) {
            forward_(begin, begin + ahead, state);
            back(begin + ahead, end, state, slots - 1);
            back(begin, begin + ahead, at_begin, slots);
            return;
        }
        if (end - begin > longest_) {  // no checkpoint is left: all steps are repeated for every leaf
            forward_(begin, end - longest_, state);
            leaf_(end - longest_, end, state);
            back(begin, end - longest_, at_begin, slots);
            return;
        }
        leaf_(begin, end, state);
    }

  private:
    Index longest_;
    Forward forward_;
    Leaf leaf_;
};

}  // namespace magshell
