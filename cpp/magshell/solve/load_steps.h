// How long the steps of the controls are, told by how those before have gone.
#pragma once

#include <utility>

#include "magshell/solve/statics.h"

namespace magshell {

/// All steps are shares of the whole way, all lengths are of the scene's extent.
class LoadSteps {
  public:
    /// wary: that of steps given up as soon as they leave the stable states, of which the first iteration tells how much too
    /// long they were.
    LoadSteps(double first, double longest, double smallest, double extent, bool wary)
        : step_(first),
          smallest_(smallest * longest),
          longest_(longest),
          extent_(extent),
          wary_(wary),
          fixed_(smallest > StaticsOptions().smallest_step) {}

    /// The next one, where so much of the way is left.
    double next(double left);

    void succeeded(double step, const NewtonReport& report);
    /// False where no shorter one is worth trying.
    bool failed(double step, const NewtonReport& report);

    /// Whether shorter ones are worth trying all the same, where it did not go down from where a branch seemed to end.
    bool insist() { return !std::exchange(insists_, true) && step_ >= smallest_; }
    /// Where the way was gone otherwise, so long again.
    void again_with(double step) { step_ = step; }

  private:
    double length_of(const NewtonReport& report) const { return report.first_length / extent_; }

    double step_, smallest_;
    const double longest_, extent_;
    const bool wary_;
    const bool fixed_;  // the smallest one, as it is larger than the usual one
    bool insists_ = false;
    int failures_ = 0;  // since the last success
    double failed_step_ = 2.0,
           failed_length_ = 0.0;  // the shortest that is known to fail, and how far it led
};

}  // namespace magshell
