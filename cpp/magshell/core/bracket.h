// An interval in which a function has a zero, for regula falsi in its Illinois variant [Dowell, Jarratt 1971].
#pragma once

#include <algorithm>

namespace magshell {

/// The ends of an interval, and a function's values there, which differ in sign.
struct Bracket {
    double lower, at_lower, upper, at_upper;

    double width() const { return upper - lower; }

    /// Returns the zero of the straight line between the values at the ends.
    double secant_zero() const { return lower + width() * at_lower / (at_lower - at_upper); }

    /// Returns the same, kept away from both ends by this fraction of the width.
    double secant_zero(double margin) const {
        return std::clamp(secant_zero(), lower + margin * width(), upper - margin * width());
    }

    /// Moves an end. The value at the other one is multiplied by `weight`: at 1 zeros of straight lines approach the zero of a curved
    /// function from one side only, at 1/2 they do not.
    void move_lower(double at, double value, double weight) {
        lower = at;
        at_lower = value;
        at_upper *= weight;
    }
    void move_upper(double at, double value, double weight) {
        upper = at;
        at_upper = value;
        at_lower *= weight;
    }
};

}  // namespace magshell
