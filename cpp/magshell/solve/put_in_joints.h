// A start of a solve whose joints have other places than where it was found.
#pragma once

#include <utility>

#include "magshell/scene/model.h"

namespace magshell {

/// Moves links that are not where joints lead them, as after a motor's origin has changed: no force tells of that, as
/// motors hold at any place.
inline void put_in_joints(const Model& model, VectorXd& q) {
    constexpr double round_off = 1e-13;  // of the extent
    VectorXd settled = q;
    model.reduction().settle(settled, nullptr);
    const double off = (settled - q).head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
    if (off > round_off * model.extent()) q = std::move(settled);
}

}  // namespace magshell
