// Values that change while a scene is solved, such as the place of a magnet over the time of a motion.
//
// For such a solve they are controls: their numbers follow the registered controls in every vector of them.
#pragma once

#include <vector>

#include "magshell/core/parameters.h"

namespace magshell {

class Varying {
  public:
    Varying() = default;
    /// `entries`: of the registered values, each once. Throws InvalidInput where one cannot vary.
    Varying(const Registry& registry, const std::vector<Index>& entries);

    bool empty() const { return slots_.empty(); }
    /// How many numbers they have.
    Index size() const { return size_; }

    /// Puts their numbers at these controls among all values; whether any is another than before.
    bool take(const Controls& controls, VectorXd& values) const;
    /// Makes the gradient by their values one by controls.
    void move_gradient(Gradient& gradient) const;

  private:
    std::vector<Slot> slots_;  // among the values
    Index first_ = 0, size_ = 0;
};

}  // namespace magshell
