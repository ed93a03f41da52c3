// Chooses the lengths of time steps such that their estimated errors stay below a tolerance.
//
// Steps are interval / 2^level long and begin at multiples of their length. A controller with continuous lengths changes all later steps
// with every change of an input, so that the result of a motion jumps by many tolerances; the steps of a ladder stay the same unless an
// estimate crosses a bound: the tolerance, or those for a step of a quarter or of twice the length.
#pragma once

#include <cstdint>

namespace magshell {

class StepLadder {
  public:
    /// order: of the method. deepest: the largest level that may be taken.
    StepLadder(double tolerance, int order, int deepest);

    /// The next step, as fractions of its interval.
    double begin() const { return static_cast<double>(place_) / parts(); }
    double end() const { return static_cast<double>(place_ + 1) / parts(); }
    double fraction() const { return 1.0 / parts(); }
    double tolerance() const { return tolerance_; }

    bool accepts(double error) const { return error <= tolerance_; }
    /// Moves on after a step with this estimated error. Returns true if the step has ended its interval.
    bool accept(double error);
    /// Makes the step shorter by one level, or by two if its error is far above the tolerance. Returns false at the deepest level.
    bool reject(double error);

  private:
    double parts() const { return static_cast<double>(std::int64_t{1} << level_); }

    double tolerance_, growth_;  // growth_: [-] of the error of a step that is twice as long
    int deepest_, level_ = 0;
    std::int64_t place_ = 0;  // in steps of this level, in the interval
};

}  // namespace magshell
