#pragma once

#include <algorithm>

#include "magshell/core/types.h"

namespace magshell {

/// Sums up the center of a body from the centers [m] and the areas or volumes of its elements.
class WeightedCenter {
  public:
    void add(double weight, const Vec3& center) {
        sum_ += weight * center;
        weight_ += weight;
    }
    Vec3 mean() const { return sum_ / weight_; }

  private:
    Vec3 sum_ = Vec3::Zero();
    double weight_ = 0.0;
};

/// Returns twice the largest distance of the nodes of elements from a center [m]. For a rectangle and a box that is the diagonal. Rotations
/// keep it, which change the sides of a bounding box.
template <class Elements>
double width_about(const Vec3& center, const Elements& elements) {
    double largest = 0.0;
    for (const auto& nodes : elements)
        for (const Vec3& node : nodes) largest = std::max(largest, (node - center).norm());
    return 2.0 * largest;
}

}  // namespace magshell
