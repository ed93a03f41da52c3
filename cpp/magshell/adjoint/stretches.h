// The steps of a motion taken back from checkpoints: those in between are done again, as often as there is no room for more.
#pragma once

#include <functional>
#include <utility>

#include "magshell/solve/dynamics.h"

namespace magshell {

class Stretches {
  public:
    using Forward = std::function<void(Index begin, Index end, MotionState& state)>;
    using Leaf = std::function<void(Index begin, Index end, const MotionState& state)>;

    /// forward: does steps again, from the state at `begin`, which moves on. leaf: takes at most `longest_leaf` steps back,
    /// of which all may be kept.
    Stretches(Index longest_leaf, Forward forward, Leaf leaf)
        : longest_(longest_leaf), forward_(std::move(forward)), leaf_(std::move(leaf)) {}

    /// Steps begin .. end, from the state at begin, with so many checkpoints to spare.
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
        if (end - begin > longest_) {  // no checkpoint left: all the way again for every leaf
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
