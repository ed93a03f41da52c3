// Binds water: its properties, of which a scene takes one object, and its force on single faces, for ms.Water.force and tests. Solves use
// cpp/magshell/terms/load/water_term.h instead.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/force/added_mass.h"
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
    MovingFace::Corners operator[](py::ssize_t face) const {
        const double* p = array_.data(face, 0, 0);
        return {Vec3(p), Vec3(p + 3), Vec3(p + 6)};
    }

  private:
    Array array_;
};

struct MovingFaces {
    FaceCorners positions, velocities;

    MovingFaces(const Array& x, const Array& v) : positions(x, "positions"), velocities(v, "velocities") {
        if (velocities.count() != count())
            throw InvalidInput("there must be as many velocities as positions");
    }
    py::ssize_t count() const { return positions.count(); }
    MovingFace at(const Water& water, py::ssize_t face) const {
        return {water.velocity, positions[face], velocities[face]};
    }
};

void store(const Mat3& from, double* to) {
    Eigen::Map<RowMajor3>{to} = from;
}

py::dict drag_faces(const Water& water, const Array& positions, const Array& velocities) {
    const MovingFaces faces(positions, velocities);
    const py::ssize_t n = faces.count(), three = 3;
    Array force({n, three}), by_position({n, three, three, three}), by_velocity({n, three, three});
    for (py::ssize_t f = 0; f < n; ++f) {
        const MovingFace face = faces.at(water, f);
        const Drag drag(water, face);
        const Drag::Jacobian jacobian = drag.corner_jacobian();
        Eigen::Map<Vec3>(force.mutable_data(f, 0)) = drag.corner_force();
        for (int k = 0; k < 3; ++k) store(jacobian.by_position[k], by_position.mutable_data(f, k, 0, 0));
        store(jacobian.by_velocity, by_velocity.mutable_data(f, 0, 0));
    }
    py::dict result;
    result["corner_force"] = force;
    result["by_position"] = by_position;
    result["by_velocity"] = by_velocity;
    return result;
}

py::dict drag_gradients(const Water& water, const Array& positions, const Array& velocities,
                        const Array& multipliers) {
    const MovingFaces faces(positions, velocities);
    const py::ssize_t n = faces.count();
    if (multipliers.ndim() != 2 || multipliers.shape(0) != n || multipliers.shape(1) != 3) {
        throw InvalidInput("multipliers must have shape (n, 3)");
    }
    Array density(n), velocity({n, py::ssize_t{3}}), drag_coefficient(n), thrust_coefficient(n), normal(n),
        tangential(n);
    for (py::ssize_t f = 0; f < n; ++f) {
        const MovingFace face = faces.at(water, f);
        const Drag::Gradient gradient = Drag(water, face).gradient(Vec3(multipliers.data(f, 0)));
        density.mutable_at(f) = gradient.fluid_density;
        Eigen::Map<Vec3>(velocity.mutable_data(f, 0)) = gradient.velocity;
        drag_coefficient.mutable_at(f) = gradient.drag_coefficient;
        thrust_coefficient.mutable_at(f) = gradient.thrust_coefficient;
        normal.mutable_at(f) = gradient.normal_viscous_drag;
        tangential.mutable_at(f) = gradient.tangential_viscous_drag;
    }
    py::dict result;
    result["fluid_density"] = density;
    result["velocity"] = velocity;
    result["drag_coefficient"] = drag_coefficient;
    result["thrust_coefficient"] = thrust_coefficient;
    result["normal_viscous_drag"] = normal;
    result["tangential_viscous_drag"] = tangential;
    return result;
}

py::dict added_mass_faces(const Water& water, const Array& positions, const Array& velocities) {
    const MovingFaces faces(positions, velocities);
    const py::ssize_t n = faces.count(), three = 3, nine = 9;
    Array energy(n), momentum({n, three}), momentum_by_position({n, three, three, three}),
        momentum_by_velocity({n, three, three}), force({n, three, three}), hessian({n, nine, nine});
    for (py::ssize_t f = 0; f < n; ++f) {
        const MovingFace face = faces.at(water, f);
        const AddedMass added(water.added_mass, face);
        energy.mutable_at(f) = added.energy(water.velocity);
        Eigen::Map<Vec3>(momentum.mutable_data(f, 0)) = added.corner_momentum();
        store(added.momentum_by_velocity(), momentum_by_velocity.mutable_data(f, 0, 0));
        const MovingFace::Corners by_position = added.by_position();
        for (int k = 0; k < 3; ++k) {
            store(added.momentum_by_position(k), momentum_by_position.mutable_data(f, k, 0, 0));
            Eigen::Map<Vec3>(force.mutable_data(f, k, 0)) = by_position[k];
        }
        Eigen::Map<AddedMass::Mat9>(hessian.mutable_data(f, 0, 0)) = added.hessian();
    }
    py::dict result;
    result["energy"] = energy;
    result["corner_momentum"] = momentum;
    result["momentum_by_position"] = momentum_by_position;
    result["momentum_by_velocity"] = momentum_by_velocity;
    result["by_position"] = force;
    result["hessian"] = hessian;
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
                         double thrust_coefficient, double added_mass, double normal_viscous_drag,
                         double tangential_viscous_drag, const AttackCurve& drag_curve,
                         const AttackCurve& thrust_curve) {
                 return std::make_shared<Water>(Water{fluid_density, Vec3(velocity.data()), drag_coefficient,
                                                      thrust_coefficient, added_mass, normal_viscous_drag,
                                                      tangential_viscous_drag, drag_curve, thrust_curve});
             }),
             py::kw_only(), py::arg("fluid_density"), py::arg("velocity"), py::arg("drag_coefficient"),
             py::arg("thrust_coefficient"), py::arg("added_mass"), py::arg("normal_viscous_drag"),
             py::arg("tangential_viscous_drag"), py::arg("drag_curve"), py::arg("thrust_curve"));

    module.def("drag_faces", &drag_faces, py::arg("water"), py::arg("positions"), py::arg("velocities"),
               "The force of water on each corner of every face without added mass (n, 3) [N], and its "
               "derivatives by "
               "the position of each corner (n, 3, 3, 3) as [face, corner, force, position] and by the mean "
               "velocity of "
               "the corners (n, 3, 3). All arguments are (n, 3, 3), a row a corner.");
    module.def("drag_gradients", &drag_gradients, py::arg("water"), py::arg("positions"),
               py::arg("velocities"), py::arg("multipliers"),
               "For each face the gradient of multiplier . f by what describes the water; f is the force on "
               "the face without added mass, multipliers are (n, 3).");
    module.def("added_mass_faces", &added_mass_faces, py::arg("water"), py::arg("positions"),
               py::arg("velocities"),
               "The energy v . dT/dv - T (n,) [J] of the water that faces push, the momentum that each "
               "corner carries "
               "(n, 3) [N s], its derivatives by the position of each corner (n, 3, 3, 3) as [face, corner, "
               "momentum, "
               "position] and by the mean velocity of the corners (n, 3, 3), and the first and second "
               "derivatives of T "
               "by positions, (n, 3, 3) [N] and (n, 9, 9) [N/m].");
}

}  // namespace magshell::bindings
