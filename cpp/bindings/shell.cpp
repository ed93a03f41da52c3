#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/scene/element_energies.h"
#include "magshell/scene/shell_stresses.h"

namespace magshell::bindings {
namespace {

py::tuple stresses_of(const Model& model, Index sheet, const VectorXd& q) {
    std::vector<FaceStress> faces;
    {
        const py::gil_scoped_release unlocked;
        faces = shell_stresses(model, sheet, q);
    }
    const auto tensors = [&](Mat3 FaceStress::* which) {
        std::vector<Mat3> rows;
        for (const FaceStress& face : faces) rows.push_back(face.*which);
        return to_matrices(rows, static_cast<Index>(rows.size()), 0);
    };
    return py::make_tuple(tensors(&FaceStress::green), tensors(&FaceStress::curvature),
                          tensors(&FaceStress::force), tensors(&FaceStress::moment));
}

py::list energies_of_elements(Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
    std::vector<EnergiesOfElements> all;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.set_angle_branches({});
        all = element_energies(model, q, load_parameters);
    }
    py::list out;
    for (const EnergiesOfElements& each : all) {
        const std::vector<double>& numbers = each.of_elements;
        out.append(
            py::make_tuple(py::str(each.name.data(), each.name.size()), each.of_solid, each.number,
                           py::array_t<double>(static_cast<py::ssize_t>(numbers.size()), numbers.data())));
    }
    return out;
}

}  // namespace

void register_sheet(py::module_& module) {
    module.def("element_energies", &energies_of_elements, py::arg("model"), py::arg("q"),
               py::arg("load_parameters"),
               "[(name, whether of a solid, number of the sheet or solid, J of each element)] of the terms "
               "that are sums "
               "over elements, in the order of term_energies. Angles are on their first branch.");
    module.def(
        "shell_stresses", &stresses_of, py::arg("model"), py::arg("sheet"), py::arg("q"),
        "(Green's strain, change of curvature [1/m], membrane force [N/m], bending moment [N]) of a sheet's "
        "faces at rest, in world axes: (n_f, 3, 3) each.");
}

}  // namespace magshell::bindings
