// Binds water: its properties, of which a scene takes one object, and its force on single faces, for ms.Water.force and tests. Solves use
// cpp/magshell/terms/load/water_term.h instead.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/force/drag.h"

namespace magshell::bindings {
namespace {

AttackCurve make_curve(const std::vector<double>& knots, const Array& cubics) {
    if (cubics.ndim() != 2 || cubics.shape(1) != 4) throw InvalidInput("cubics must have shape (n, 4)");
    std::vector<AttackCurve::Cubic> pieces(cubics.shape(0));
    for (std::size_t k = 0; k < pieces.size(); ++k) std::copy_n(cubics.data(k, 0), 4, pieces[k].begin());
    return AttackCurve(knots, std::move(pieces));
}

Array curve_samples(const AttackCurve& curve, const Array& angles) {
    Array samples({angles.size(), py::ssize_t{2}});
    for (py::ssize_t k = 0; k < angles.size(); ++k) {
        const double angle = angles.data()[k];
        const AttackCurve::Sample sample = curve.at(std::sin(angle), std::cos(angle));
        samples.mutable_at(k, 0) = sample.value;
        samples.mutable_at(k, 1) = sample.slope;
    }
    return samples;
}

/// The corners of n faces: (n, 3, 3).
class FaceCorners {
  public:
    FaceCorners(const Array& array, const char* name) : array_(array) {
        if (array.ndim() != 3 || array.shape(1) != 3 || array.shape(2) != 3) {
            throw InvalidInput(std::string(name) + " must have shape (n, 3, 3)");
        }
    }
    py::ssize_t count() const { return array_.shape(0); }
    Drag::Corners operator[](py::ssize_t face) const {
        const double* p = array_.data(face, 0, 0);
        return {Vec3(p), Vec3(p + 3), Vec3(p + 6)};
    }

  private:
    Array array_;
};

struct MovingFaces {
    FaceCorners positions, velocities, accelerations;

    MovingFaces(const Array& x, const Array& v, const Array& w)
        : positions(x, "positions"), velocities(v, "velocities"), accelerations(w, "accelerations") {
        if (velocities.count() != count() || accelerations.count() != count()) {
            throw InvalidInput("there must be as many velocities and accelerations as positions");
        }
    }
    py::ssize_t count() const { return positions.count(); }
    Drag drag(const Water& water, py::ssize_t face) const {
        return Drag(water, positions[face], velocities[face], accelerations[face]);
    }
};

py::dict drag_faces(const Water& water, const Array& positions, const Array& velocities,
                    const Array& accelerations) {
    const MovingFaces faces(positions, velocities, accelerations);
    const py::ssize_t n = faces.count(), three = 3;
    Array force({n, three}), by_position({n, three, three, three}), by_velocity({n, three, three}),
        by_acceleration({n, three, three});
    for (py::ssize_t f = 0; f < n; ++f) {
        const Drag drag = faces.drag(water, f);
        const Drag::Jacobian jacobian = drag.corner_jacobian();
        Eigen::Map<Vec3>(force.mutable_data(f, 0)) = drag.corner_force();
        for (int k = 0; k < 3; ++k)
            Eigen::Map<RowMajor3>(by_position.mutable_data(f, k, 0, 0)) = jacobian.by_position[k];
        Eigen::Map<RowMajor3>(by_velocity.mutable_data(f, 0, 0)) = jacobian.by_velocity;
        Eigen::Map<RowMajor3>(by_acceleration.mutable_data(f, 0, 0)) = jacobian.by_acceleration;
    }
    py::dict result;
    result["corner_force"] = force;
    result["by_position"] = by_position;
    result["by_velocity"] = by_velocity;
    result["by_acceleration"] = by_acceleration;
    return result;
}

py::dict drag_gradients(const Water& water, const Array& positions, const Array& velocities,
                        const Array& accelerations, const Array& multipliers) {
    const MovingFaces faces(positions, velocities, accelerations);
    const py::ssize_t n = faces.count();
    if (multipliers.ndim() != 2 || multipliers.shape(0) != n || multipliers.shape(1) != 3) {
        throw InvalidInput("multipliers must have shape (n, 3)");
    }
    Array density(n), velocity({n, py::ssize_t{3}}), drag_coefficient(n), thrust_coefficient(n),
        added_mass(n);
    for (py::ssize_t f = 0; f < n; ++f) {
        const Drag::Gradient gradient = faces.drag(water, f).gradient(Vec3(multipliers.data(f, 0)));
        density.mutable_at(f) = gradient.fluid_density;
        Eigen::Map<Vec3>(velocity.mutable_data(f, 0)) = gradient.velocity;
        drag_coefficient.mutable_at(f) = gradient.drag_coefficient;
        thrust_coefficient.mutable_at(f) = gradient.thrust_coefficient;
        added_mass.mutable_at(f) = gradient.added_mass;
    }
    py::dict result;
    result["fluid_density"] = density;
    result["velocity"] = velocity;
    result["drag_coefficient"] = drag_coefficient;
    result["thrust_coefficient"] = thrust_coefficient;
    result["added_mass"] = added_mass;
    return result;
}

}  // namespace

void register_water(py::module_& module) {
    py::class_<AttackCurve>(module, "AttackCurve")
        .def(py::init<>(), "2 sin^2 phi")
        .def(py::init(&make_curve), py::arg("knots"), py::arg("cubics"),
             "Cubics (n, 4) of (phi - knot), the highest power first, between n + 1 knots [rad].")
        .def("samples", &curve_samples, py::arg("angles"),
             "Value and slope at angles (n,) [rad] in [0, pi/2]: (n, 2).");

    py::class_<Water, std::shared_ptr<Water>>(module, "Water")
        .def(py::init([](double fluid_density, const std::array<double, 3>& velocity, double drag_coefficient,
                         double thrust_coefficient, double added_mass, const AttackCurve& drag_curve,
                         const AttackCurve& thrust_curve) {
                 return std::make_shared<Water>(Water{fluid_density, Vec3(velocity.data()), drag_coefficient,
                                                      thrust_coefficient, added_mass, drag_curve,
                                                      thrust_curve});
             }),
             py::kw_only(), py::arg("fluid_density"), py::arg("velocity"), py::arg("drag_coefficient"),
             py::arg("thrust_coefficient"), py::arg("added_mass"), py::arg("drag_curve"),
             py::arg("thrust_curve"));

    module.def(
        "drag_faces", &drag_faces, py::arg("water"), py::arg("positions"), py::arg("velocities"),
        py::arg("accelerations"),
        "The force of water on each corner of every face (n, 3) [N], and its derivatives by the position of "
        "each corner (n, 3, 3, 3) as [face, corner, force, position], by the mean velocity and by the mean "
        "acceleration of the corners (n, 3, 3). All arguments are (n, 3, 3), a row a corner.");
    module.def("drag_gradients", &drag_gradients, py::arg("water"), py::arg("positions"),
               py::arg("velocities"), py::arg("accelerations"), py::arg("multipliers"),
               "For each face the gradient of multiplier . f by what describes the water; f is the force on "
               "the face, "
               "multipliers are (n, 3).");
}

}  // namespace magshell::bindings
