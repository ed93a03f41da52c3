// The derivative of a vector function of one number at zero, by central differences of eighth order.
#pragma once

#include <functional>
#include <span>

#include "magshell/core/types.h"

namespace magshell {

/// Computes such derivatives of similar functions, one after another: the step that sufficed for the last one is tried first.
class DirectionalDerivative {
  public:
    using Function = std::function<VectorXd(double)>;

    /// Returns the derivative. The entries of the function form blocks, each of one unit; ends: where the blocks end, except the last one.
    /// first_step: the largest step over which the function is expected to be smooth. noise: the largest numbers that cancel in each block;
    /// round-off is a fraction of them. The function may throw InvalidInput beyond its range. Throws InvalidInput with the name if the
    /// function is not smooth.
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

    double factor_ = 1.0;    // [-] by which the last derivative had to shorten its first step
    double expected_ = 0.0;  // [-] error of that derivative
    int evaluations_ = 0;
};

}  // namespace magshell
