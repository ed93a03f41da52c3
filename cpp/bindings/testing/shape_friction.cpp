// Binds the friction of one smooth shape on an obstacle, both of which rigid bodies carry.
#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/energy/contact.h"
#include "magshell/terms/contact/round_motion.h"

namespace magshell::bindings {
namespace {

std::vector<Vec3> points_of(const Array& given) {
    if (given.ndim() != 2 || given.shape(0) != RoundMotion::places || given.shape(1) != 3)
        throw InvalidInput("points must have shape (8, 3)");
    std::vector<Vec3> points;
    for (py::ssize_t k = 0; k < given.shape(0); ++k) points.emplace_back(given.data(k, 0));
    return points;
}

// The stiffness is 1 and the coefficient of friction too. Both bodies have their frames in the world's at rest.
py::dict shape_friction(const ShapeCore& core, const Vec3& center, const Obstacle& obstacle,
                        const Vec3& obstacle_center, double smoothing, double sticking_speed,
                        const Array& rest, const Array& positions, const Array& velocities) {
    const std::vector<Vec3> at_rest = points_of(rest);
    const VectorXd q = to_vector(positions), v = to_vector(velocities);
    if (q.size() != 3 * RoundMotion::places || v.size() != q.size())
        throw InvalidInput("positions and velocities must have shape (8, 3)");
    const CornerFrame own({0, 1, 2, 3}, at_rest), other({4, 5, 6, 7}, at_rest);
    const CornerFrame::Pose pose = other.pose(q.data());
    const auto distance = [&](const Vec3& x) {
        const Distance found = obstacle.distance(other.at_rest(pose, x) - obstacle_center);
        return RelativeMotion(other, pose, x).in_world(found);
    };
    const RoundMotion motion({0, 1, core}, {center, Vec3::Zero()}, own, &other, distance, q.data());
    const Distance gap = motion.gap();
    const Penalty penalty(std::max(-gap.value, 0.0), smoothing);
    const RoundMotion surface = motion.on_surface();
    const Friction friction(penalty.force, gap.normal, surface.motion(v.data()), sticking_speed);
    Array forces({py::ssize_t{RoundMotion::places}, py::ssize_t{3}});
    for (int k = 0; k < RoundMotion::places; ++k)
        Eigen::Map<Vec3>(forces.mutable_data(k, 0)) = surface.reaction(k, friction.force);
    py::dict found;
    found["gap"] = gap.value;
    found["forces"] = forces;
    found["by_positions"] = to_matrices(surface.by_positions(friction, penalty.stiffness, Vec3::Zero(), v),
                                        RoundMotion::places, RoundMotion::places);
    return found;
}

}  // namespace

void register_shape_friction(py::module_& module) {
    module.def(
        "shape_friction", &shape_friction, py::arg("core"), py::arg("center"), py::arg("obstacle"),
        py::arg("obstacle_center"), py::arg("smoothing"), py::arg("sticking_speed"), py::arg("rest"),
        py::arg("positions"), py::arg("velocities"),
        "The gap [m] between a shape and an obstacle, and the friction's forces (8, 3) [N] on the corners of "
        "both rigid "
        "bodies, with their derivatives by positions at constant velocities (8, 8, 3, 3), for a contact "
        "stiffness and a coefficient of friction of 1.");
}

}  // namespace magshell::bindings
