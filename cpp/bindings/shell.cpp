#include "bindings/arrays.h"
#include "bindings/bindings.h"
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

}  // namespace

void register_sheet(py::module_& module) {
    module.def(
        "shell_stresses", &stresses_of, py::arg("model"), py::arg("sheet"), py::arg("q"),
        "(Green's strain, change of curvature [1/m], membrane force [N/m], bending moment [N]) of a sheet's "
        "faces at rest, in world axes: (n_f, 3, 3) each.");
}

}  // namespace magshell::bindings
