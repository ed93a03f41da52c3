// Binds obstacles: one factory per shape, and distances at many points.
#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "bindings/arrays.h"
#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/obstacle/height_field.h"
#include "magshell/obstacle/mesh_obstacle.h"
#include "magshell/obstacle/simple_shapes.h"
#include "magshell/obstacle/tube.h"
#include "magshell/terms/contact/nearest_point.h"

namespace magshell::bindings {
namespace {

using Shared = std::shared_ptr<Obstacle>;
using Triple = std::array<double, 3>;

Vec3 vec(const Triple& components) {
    return Vec3(components.data());
}

std::span<const double> span_of(const Array& array) {
    return {array.data(), static_cast<std::size_t>(array.size())};
}

py::tuple distances(const Obstacle& obstacle, const Array& points) {
    if (points.ndim() != 2 || points.shape(1) != 3) throw InvalidInput("points must have shape (n, 3)");
    const py::ssize_t n = points.shape(0), three = 3;
    Array values(n), normals({n, three}), curvatures({n, three, three});
    const double* x = points.data();
    double *value = values.mutable_data(), *normal = normals.mutable_data(),
           *curvature = curvatures.mutable_data();
    {
        const py::gil_scoped_release release;
        constexpr py::ssize_t block = 256;
        parallel_for(static_cast<int>((n + block - 1) / block), [&](int b) {
            for (py::ssize_t k = b * block; k < std::min(n, (b + 1) * block); ++k) {
                const Distance d = obstacle.distance(Eigen::Map<const Vec3>(x + 3 * k));
                value[k] = d.value;
                Eigen::Map<Vec3>(normal + 3 * k) = d.normal;
                Eigen::Map<Mat3>(curvature + 9 * k) = d.curvature;  // symmetric
            }
        });
    }
    return py::make_tuple(values, normals, curvatures);
}

Shared make_tube(const Array& points, const Array& radii, bool closed) {
    if (points.ndim() != 2 || points.shape(1) != 3) throw InvalidInput("points must have shape (k, 3)");
    std::vector<Vec3> through;
    for (py::ssize_t k = 0; k < points.shape(0); ++k) through.emplace_back(points.data(k, 0));
    return std::make_shared<Tube>(through, span_of(radii), closed);
}

Shared make_height_field(const std::array<double, 2>& origin, const std::array<double, 2>& spacing,
                         const Array& heights) {
    if (heights.ndim() != 2) throw InvalidInput("heights must have shape (n_x, n_y)");
    return std::make_shared<HeightField>(
        HeightField::Pair(origin.data()), HeightField::Pair(spacing.data()),
        std::array<Index, 2>{static_cast<Index>(heights.shape(0)), static_cast<Index>(heights.shape(1))},
        span_of(heights));
}

// The columns of `half` are those of H; a point has none.
ShapeCore make_core(const Vec3& middle, const Eigen::MatrixXd& half, double radius, double crown) {
    const int dimensions = static_cast<int>(half.cols());
    if (half.rows() != 3 || (dimensions != 0 && dimensions != 1 && dimensions != 3))
        throw InvalidInput("half must have shape (3, 0), (3, 1) or (3, 3)");
    ShapeCore core{middle, Mat3::Zero(), dimensions, radius, crown};
    core.half.leftCols(dimensions) = half;
    return core;
}

py::tuple nearest_point(const Obstacle& obstacle, const ShapeCore& core, const Vec3& center,
                        const Mat3& axes) {
    const NearestPoint found(core, center + axes * core.middle, axes * core.half,
                             [&](const Vec3& x) { return obstacle.distance(x); });
    const Vec3 touch = found.point - core.radius * found.at.normal;
    return py::make_tuple(found.at.value + found.rise - core.radius, found.at.normal, touch);
}

}  // namespace

void register_obstacle(py::module_& module) {
    py::class_<Obstacle, Shared>(module, "Obstacle")
        .def_static(
            "plane", [](const Triple& normal) -> Shared { return std::make_shared<Plane>(vec(normal)); },
            py::arg("normal"))
        .def_static(
            "sphere", [](double radius) -> Shared { return std::make_shared<Sphere>(radius); },
            py::arg("radius"))
        .def_static(
            "box",
            [](const Triple& half_extents, double rounding) -> Shared {
                return std::make_shared<Box>(vec(half_extents), rounding);
            },
            py::arg("half_extents"), py::arg("rounding"))
        .def_static(
            "capsule",
            [](const Triple& start, const Triple& end, double radius) -> Shared {
                return std::make_shared<Capsule>(vec(start), vec(end), radius);
            },
            py::arg("start"), py::arg("end"), py::arg("radius"))
        .def_static(
            "ellipsoid",
            [](const Triple& semi_axes) -> Shared { return std::make_shared<Ellipsoid>(vec(semi_axes)); },
            py::arg("semi_axes"))
        .def_static("tube", &make_tube, py::arg("points"), py::arg("radii"), py::arg("closed"))
        .def_static("height_field", &make_height_field, py::arg("origin"), py::arg("spacing"),
                    py::arg("heights"))
        .def_static(
            "mesh",
            [](const TriangleMesh& mesh, Index resolution) -> Shared {
                return std::make_shared<MeshObstacle>(mesh, resolution);
            },
            py::arg("mesh"), py::arg("resolution"), py::call_guard<py::gil_scoped_release>())
        .def(
            "inverted", [](const Shared& body) -> Shared { return std::make_shared<Complement>(body); },
            "The space around the body, as a body.");

    py::class_<ShapeCore>(module, "ShapeCore", "The core of a smooth shape that a rigid body carries.")
        .def(py::init(&make_core), py::arg("middle"), py::arg("half"), py::arg("radius"), py::arg("crown"));

    module.def("nearest_point", &nearest_point, py::arg("obstacle"), py::arg("core"), py::arg("center"),
               py::arg("axes"),
               "The distance [m] of a shape from an obstacle, the normal (3,) and the point (3,) [m] of the "
               "shape nearest to it, in the obstacle's own frame, where the shape's has this center (3,) [m] "
               "and these axes (3, 3).");

    module.def("distances", &distances, py::arg("obstacle"), py::arg("points"),
               "At points (n, 3) [m] of the obstacle's own frame: signed distances (n,) [m], normals (n, 3) "
               "and second "
               "derivatives (n, 3, 3) [1/m].");
}

}  // namespace magshell::bindings
