// CornerWeights: vectors and points that a rigid body carries, as sums over the four corners x_k of its tetrahedron (assembly/, rigid
// bodies) with the reference positions rho_k relative to their middle. With sum rho_k rho_k^T = 4 l^2 I:
//
//   R m = sum alpha_k x_k,                  alpha_k = rho_k . m / 4 l^2
//   c + R (center - c~) = sum b_k x_k,      b_k = 1/4 + rho_k . (center - c~) / 4 l^2
#pragma once

#include <array>

#include "magshell/body/nodes.h"

namespace magshell {

class CornerWeights {
  public:
    using Each = std::array<double, 4>;

    CornerWeights(const std::array<Index, 4>& corners, const Nodes& nodes) {
        for (const Index node : corners) middle_ += 0.25 * nodes.rest[node];
        for (int k = 0; k < 4; ++k) {
            const Vec3 rho = nodes.rest[corners[k]] - middle_;
            offsets_[k] = rho * (3.0 / (4.0 * rho.squaredNorm()));  // |rho|^2 = 3 l^2
        }
    }

    Each of_vector(const Vec3& vector) const {
        Each weights;
        for (int k = 0; k < 4; ++k) weights[k] = offsets_[k].dot(vector);
        return weights;
    }
    Each of_point(const Vec3& point) const {
        const Vec3 from_middle = point - middle_;
        Each weights;
        for (int k = 0; k < 4; ++k) weights[k] = 0.25 + offsets_[k].dot(from_middle);
        return weights;
    }
    /// Returns the derivative with respect to the vector or the point, given those with respect to its weights.
    Vec3 gradient(const Each& by_weights) const {
        Vec3 sum = Vec3::Zero();
        for (int k = 0; k < 4; ++k) sum += by_weights[k] * offsets_[k];
        return sum;
    }

  private:
    Vec3 middle_ = Vec3::Zero();
    std::array<Vec3, 4> offsets_;  // rho_k / 4 l^2
};

}  // namespace magshell
