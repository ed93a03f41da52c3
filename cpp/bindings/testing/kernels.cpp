// Binds single functions of the core: logarithms and angles in SIMD lanes, the loaded part of a matrix.
#include <memory>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/core/simd_angle.h"
#include "magshell/core/simd_functions.h"
#include "magshell/linalg/krylov/operator_factor.h"
#include "magshell/linalg/loaded_part.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell::bindings {
namespace {

// Returns a function of each pair of numbers as the lanes of SIMD vectors compute it; the last vector is filled up with ones.
template <class Value, class Function>
py::array_t<double> in_lanes(const Array& first, const Array& second, const Function& function) {
    py::array_t<double> out(first.size());
    double* to = out.mutable_data();
    for (py::ssize_t begin = 0; begin < first.size(); begin += Value::width) {
        Value a(1.0f), b(1.0f);
        const int lanes = static_cast<int>(std::min<py::ssize_t>(Value::width, first.size() - begin));
        for (int lane = 0; lane < lanes; ++lane) {
            a.set(lane, first.data()[begin + lane]);
            b.set(lane, second.data()[begin + lane]);
        }
        a = function(a, b);
        for (int lane = 0; lane < lanes; ++lane) to[begin + lane] = a[lane];
    }
    return out;
}

py::array_t<double> lane_logarithms(const Array& numbers) {
    return in_lanes<SimdDouble>(numbers, numbers,
                                [](const SimdDouble& a, const SimdDouble&) { return log(a); });
}

py::array_t<double> lane_angles(const Array& sines, const Array& cosines, bool single_precision) {
    if (sines.size() != cosines.size())
        throw InvalidInput("sines and cosines must have the same number of entries");
    const auto angle = [](const auto& sine, const auto& cosine) { return angle_of(sine, cosine); };
    return single_precision ? in_lanes<SimdFloat>(sines, cosines, angle)
                            : in_lanes<SimdDouble>(sines, cosines, angle);
}

py::tuple loaded(Index size, const IndexArray& column_starts, const IndexArray& rows, const Array& values,
                 const VectorXd& forces) {
    const SparsePattern pattern{size, to_indices(column_starts, "column_starts"), to_indices(rows, "rows")};
    check_pattern(pattern);
    if (values.ndim() != 1 || values.size() != rows.size() || forces.size() != size)
        throw InvalidInput("values must have " + std::to_string(rows.size()) +
                           " entries, one per row index, and " + "forces " + std::to_string(size) +
                           ", one per row of the matrix");
    LoadedPart part;
    {
        const py::gil_scoped_release release;
        part = loaded_part(pattern, {values.data(), static_cast<std::size_t>(values.size())}, forces);
    }
    return py::make_tuple(given_away(std::move(part.unknowns)),
                          given_away(std::move(part.pattern.column_starts)),
                          given_away(std::move(part.pattern.rows)), given_away(std::move(part.values)));
}

// Factorizes a sparse matrix plus a dense symmetric one that is known by its products only, and solves with it: exactly, or to a positive
// tolerance. `rough` has the products that need not be exact. Returns (report, solution).
py::tuple solve_with_operator(Index size, const IndexArray& column_starts, const IndexArray& rows,
                              const Array& values, const Eigen::MatrixXd& added, VectorXd rhs,
                              const Eigen::MatrixXd& rough, double tolerance) {
    std::shared_ptr<SparsePattern> pattern = std::make_shared<SparsePattern>(
        SparsePattern{size, to_indices(column_starts, "column_starts"), to_indices(rows, "rows")});
    check_pattern(*pattern);
    OperatorFactor factor(analyze(pattern));
    std::copy_n(values.data(), values.size(), factor.values().begin());
    factor.set_operator([added](const VectorXd& x) { return VectorXd(added * x); },
                        [rough](const VectorXd& x) { return VectorXd(rough * x); });
    const FactorReport report = factor.factorize();
    if (tolerance > 0.0)
        factor.solve_approximately(rhs, tolerance);
    else
        factor.solve(rhs);
    return py::make_tuple(report, rhs);
}

}  // namespace

void register_kernels(py::module_& module) {
    module.def("lane_logarithms", &lane_logarithms, py::arg("numbers"),
               "ln of an array's numbers as the element kernels take it, to be tested.");
    module.def("lane_angles", &lane_angles, py::arg("sines"), py::arg("cosines"),
               py::arg("single_precision") = false,
               "Angles of unit vectors as the kernels of the own field take them, to be tested.");
    module.def("solve_with_operator", &solve_with_operator, py::arg("size"), py::arg("column_starts"),
               py::arg("rows"), py::arg("values"), py::arg("added"), py::arg("rhs"), py::arg("rough"),
               py::arg("tolerance") = 0.0);
    module.def("loaded_part", &loaded, py::arg("size"), py::arg("column_starts"), py::arg("rows"),
               py::arg("values"), py::arg("forces"),
               "Of a symmetric matrix, given as to analyze(), the part that forces (n,) act on: its "
               "unknowns, column_starts, "
               "rows and values, without zeros off its diagonal. Nothing couples it with the rest. All of "
               "the matrix where no force acts.");
}

}  // namespace magshell::bindings
