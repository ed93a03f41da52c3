#include "magshell/solve/globalization/obstacle_sides.h"

#include <algorithm>

namespace magshell {

void ObstacleSides::remember(const VectorXd& q, const LoadParameters& load_parameters) {
    if (!model_.has_contact()) return;
    places_ = model_.contact()->own_positions(q, load_parameters);
    rotation_vectors_ = model_.contact()->rotation_vectors(load_parameters);
}

std::string ObstacleSides::crossed(const VectorXd& q, const LoadParameters& load_parameters) const {
    if (!model_.has_contact()) return {};
    const Index node =
        model_.contact()->passes_between(places_, model_.contact()->own_positions(q, load_parameters));
    if (node < 0) return {};
    return "vertex " + std::to_string(model_.nodes().user_vertex(node)) +
           " passes through an obstacle, however short the step";
}

double ObstacleSides::turned(const LoadParameters& load_parameters) const {
    double largest = 0.0;
    if (!model_.has_contact()) return largest;
    const std::vector<Vec3> now = model_.contact()->rotation_vectors(load_parameters);
    for (std::size_t k = 0; k + 1 < now.size(); k += 2)
        largest = std::max(
            largest, (now[k] - rotation_vectors_[k]).norm() + (now[k + 1] - rotation_vectors_[k + 1]).norm());
    return largest;
}

}  // namespace magshell
