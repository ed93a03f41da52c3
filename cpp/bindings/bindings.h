// The declarations that the binding files share: one register function per family, and arrays in C order and
// float64.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>

namespace magshell::bindings {

namespace py = pybind11;

// Arrays in C order and float64 (int32 for indices); numpy converts anything else.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A matrix in the memory layout of numpy.
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using IndexArray = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

void register_adjoint(py::module_& module);
void register_body_contact(py::module_& module);
void register_errors(py::module_& module);
void register_mesh(py::module_& module);
void register_continuation(py::module_& module);
void register_dynamics(py::module_& module);
void register_face_energies(py::module_& module);
void register_field(py::module_& module);
void register_group_energy(py::module_& module);
void register_linalg(py::module_& module);
void register_model(py::module_& module);
void register_obstacle(py::module_& module);
void register_picture(py::module_& module);
void register_sheet(py::module_& module);
void register_muscle(py::module_& module);
void register_solid(py::module_& module);
void register_statics(py::module_& module);
void register_water(py::module_& module);

// Single kernels, which scenes evaluate by whole terms: bound for tests and benchmarks only, where MAGSHELL_TESTING is on.
void register_contact_pairs(py::module_& module);
void register_elimination_fronts(py::module_& module);
void register_shape_friction(py::module_& module);
void register_kernels(py::module_& module);

}  // namespace magshell::bindings
