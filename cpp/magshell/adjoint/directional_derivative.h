// The derivative of a vector function of one number at zero, by central differences of eighth order.
#pragma once

#include <functional>
#include <span>

#include "magshell/core/types.h"

namespace magshell {

/// Takes such derivatives, one after another, of functions that resemble each other: it begins with the step that served last.
class DirectionalDerivative {
  public:
    using Function = std::function<VectorXd(double)>;

    /// Returns the derivative. ends: of the blocks of entries that have one unit each, except the last one. first_step: changes the function
    /// as much as its smoothness allows, as far as is known. noise: the largest numbers that cancel in each block, of which round-off is a
    /// part. The function may throw InvalidInput beyond its range. Throws InvalidInput with the name if the function is not smooth.
    VectorXd of(const Function& function, std::span<const Index> ends, double first_step,
                std::span<const double> noise, const char* name);
    VectorXd of(const Function& function, double first_step, double noise, const char* name) {
        return of(function, {}, first_step, {&noise, 1}, name);
    }
    int evaluations() const { return evaluations_; }

  private:
    struct Attempt {
        VectorXd derivative;
        double error = 0.0;      // [-] of a block, relative to its largest entry
        bool truncated = false;  // whether it is larger than round-off
        bool jumps = false;      // whether the function may not be smooth
    };
    Attempt attempt(const Function& function, std::span<const Index> ends, double step,
                    std::span<const double> noise);

    double factor_ = 1.0;    // [-] of the first step
    double expected_ = 0.0;  // [-] the error that was found then
    int evaluations_ = 0;
};

}  // namespace magshell
