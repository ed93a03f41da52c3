#include <algorithm>
#include <map>
#include <optional>
#include <string>

#include "bindings/arrays.h"
#include "bindings/scene_input.h"
#include "magshell/scene/model.h"
#include "magshell/terms/actuator/muscle_term.h"

namespace magshell::bindings {
namespace {

// Converts (origin, spacing, coefficients), or None, to a curve.
FibreCurve curve_of(const py::handle& given) {
    if (given.is_none()) return {};
    const py::tuple parts = py::reinterpret_borrow<py::tuple>(given);
    return FibreCurve(parts[0].cast<double>(), parts[1].cast<double>(), parts[2].cast<std::vector<double>>());
}

FibreLaw law_of(const py::handle& muscle) {
    const std::map<std::string, FibreForm> forms = {{"target stretch", FibreForm::target_stretch},
                                                    {"active stress", FibreForm::active_stress},
                                                    {"hill", FibreForm::hill}};
    return {forms.at(muscle["form"].cast<std::string>()), curve_of(muscle["force_length"]),
            curve_of(muscle["passive"]), curve_of(muscle["force_velocity"])};
}

// Returns numbers as (n, p), for n elements with p points each.
py::array_t<double> muscle_rows_of(const std::vector<double>& numbers, int points) {
    py::array_t<double> rows(
        {static_cast<py::ssize_t>(numbers.size()) / points, static_cast<py::ssize_t>(points)});
    std::copy(numbers.begin(), numbers.end(), rows.mutable_data());
    return rows;
}

py::tuple fibre_states(const Model& model, Index muscle, const VectorXd& q,
                       const std::optional<VectorXd>& v) {
    FibreStates states;
    {
        const py::gil_scoped_release unlocked;
        states = model.terms().muscles[muscle]->states(q.data(), v ? v->data() : nullptr);
    }
    return py::make_tuple(muscle_rows_of(states.stretches, states.points),
                          muscle_rows_of(states.tensions, states.points),
                          muscle_rows_of(states.volumes, states.points));
}

}  // namespace

std::vector<MuscleInput> muscles_of(const py::list& given) {
    std::vector<MuscleInput> muscles;
    for (const py::handle each : given) {
        MuscleInput& muscle = muscles.emplace_back();
        muscle.owner = each["owner"].cast<std::string>();
        muscle.solid = each["solid"].cast<Index>();
        muscle.elements = each["elements"].cast<std::vector<Index>>();
        muscle.segments = each["segments"].cast<std::vector<Index>>();
        muscle.n_segments = each["n_segments"].cast<Index>();
        muscle.law = law_of(each);
    }
    return muscles;
}

void register_muscle(py::module_& module) {
    module.def(
        "fibre_states", &fibre_states, py::arg("model"), py::arg("muscle"), py::arg("q"), py::arg("v"),
        "(stretches |F m|, tensions [Pa] a rest area, rest volumes [m3]) at the points of integration of "
        "a muscle's elements, (n, p) each. v: velocities of all unknowns [m/s], or None.");
}

}  // namespace magshell::bindings
