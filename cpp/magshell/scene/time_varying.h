// Parameters that change during a solve, such as the position of a magnet over the time of a motion.
//
// During such a solve they are load parameters: their numbers are appended to the registered ones in every vector of load parameters.
#pragma once

#include <vector>

#include "magshell/core/parameters.h"

namespace magshell {

class TimeVaryingParameters {
  public:
    TimeVaryingParameters() = default;
    /// entries: indices of registered values, each once. Throws InvalidInput if one cannot vary.
    TimeVaryingParameters(const Registry& registry, const std::vector<Index>& entries);

    bool empty() const { return slices_.empty(); }
    /// Returns the total number of components.
    Index size() const { return size_; }

    /// Copies the numbers from load parameters into the vector of all values. Returns true if any of them changed.
    bool update(const LoadParameters& load_parameters, VectorXd& values) const;
    /// Moves the gradient with respect to these values to the gradient with respect to load parameters.
    void move_gradient(Gradient& gradient) const;

  private:
    std::vector<ParameterSlice> slices_;  // positions among the values
    Index first_ = 0, size_ = 0;
};

}  // namespace magshell
