#include "magshell/solve/globalization/obstacle_sides.h"

#include <algorithm>

namespace magshell {

void ObstacleSides::remember(const VectorXd& q, const LoadParameters& load_parameters) {
    frames_ = model_.contacts().obstacle_frames(q, load_parameters);
}

std::string ObstacleSides::crossed(const VectorXd& q, const LoadParameters& load_parameters) const {
    const Contacts& contacts = model_.contacts();
    const Passage passage = contacts.first_crossing(frames_, contacts.obstacle_frames(q, load_parameters));
    return passage ? passage.describe(model_.nodes()) + ", however short the step" : std::string();
}

double ObstacleSides::turned(const LoadParameters& load_parameters) const {
    double largest = 0.0;
    const std::vector<Vec3> now = model_.contacts().obstacle_rotations(load_parameters),
                            &before = frames_.rotation_vectors;
    for (std::size_t k = 0; k + 1 < now.size(); k += 2)
        largest = std::max(largest, (now[k] - before[k]).norm() + (now[k + 1] - before[k + 1]).norm());
    return largest;
}

}  // namespace magshell
