// Binds TriangleMesh: arrays in, read-only views out.
#include <memory>
#include <string>

#include "bindings/arrays.h"
#include "magshell/core/errors.h"
#include "magshell/mesh/self_intersections.h"

namespace magshell::bindings {

namespace {

using LongIndexArray = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

void check_rows3(const py::array& array, const char* name, const char* rows) {
    if (array.ndim() == 2 && array.shape(1) == 3) return;
    const std::string shape = py::str(py::tuple(array.attr("shape")));
    throw InvalidInput(std::string(name) + " must have shape (" + rows + ", 3), got " + shape);
}

std::shared_ptr<TriangleMesh> make_mesh(const Array& rest_positions, const LongIndexArray& faces) {
    check_rows3(rest_positions, "rest_positions [m]", "n_v");
    check_rows3(faces, "faces", "n_f");
    Rows3 positions = Eigen::Map<const Rows3>(rest_positions.data(), rest_positions.shape(0), 3);
    const Rows3l face_rows = Eigen::Map<const Rows3l>(faces.data(), faces.shape(0), 3);
    const py::gil_scoped_release unlocked;
    return std::make_shared<TriangleMesh>(std::move(positions), face_rows);
}

// Returns a read-only view into the mesh that keeps the mesh alive.
template <auto member>
py::array view(const py::object& self) {
    const auto& rows = (self.cast<const TriangleMesh&>().*member)();
    using Scalar = typename std::decay_t<decltype(rows)>::Scalar;
    py::array_t<Scalar> array({rows.rows(), rows.cols()}, rows.data(), self);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

// Returns pairs of faces, (k, 2).
IndexArray crossings(const TriangleMesh& mesh, const Array& positions) {
    std::vector<std::pair<Index, Index>> pairs;
    {
        const Rows3 rows = to_rows3(positions);
        const py::gil_scoped_release unlocked;
        pairs = self_intersections(mesh, rows);
    }
    IndexArray array({static_cast<py::ssize_t>(pairs.size()), py::ssize_t{2}});
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        array.mutable_at(k, 0) = pairs[k].first;
        array.mutable_at(k, 1) = pairs[k].second;
    }
    return array;
}

}  // namespace

void register_mesh(py::module_& module) {
    py::class_<TriangleMesh, std::shared_ptr<TriangleMesh>>(module, "TriangleMesh")
        .def(py::init(&make_mesh), py::arg("rest_positions"), py::arg("faces"))
        .def_property_readonly("rest_positions", &view<&TriangleMesh::rest_positions>)
        .def_property_readonly("faces", &view<&TriangleMesh::faces>)
        .def_property_readonly("edges", &view<&TriangleMesh::edges>)
        .def_property_readonly("edge_faces", &view<&TriangleMesh::edge_faces>)
        .def_property_readonly("face_edges", &view<&TriangleMesh::face_edges>)
        .def("self_intersections", &crossings, py::arg("positions"));
}

}  // namespace magshell::bindings
