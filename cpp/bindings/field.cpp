// Binds the applied magnetic fields, and one that calls Python.
#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bindings/call_python.h"
#include "magshell/core/errors.h"
#include "magshell/energy/face_points.h"
#include "magshell/field/dipoles.h"
#include "magshell/field/magnet.h"
#include "magshell/field/posed_field.h"
#include "magshell/field/sampled_field.h"

namespace magshell::bindings {
namespace {

std::vector<Vec3> to_vectors(const Array& array, const char* name) {
    if (array.ndim() < 1 || array.shape(array.ndim() - 1) != 3) {
        throw InvalidInput(std::string(name) + " must have three components in its last axis");
    }
    std::vector<Vec3> result(array.size() / 3);
    for (std::size_t k = 0; k < result.size(); ++k) result[k] = Eigen::Map<const Vec3>(array.data() + 3 * k);
    return result;
}

Array from_vectors(std::span<const Vec3> vectors) {
    Array result({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}});
    for (std::size_t k = 0; k < vectors.size(); ++k) {
        Eigen::Map<Vec3>(result.mutable_data() + 3 * k) = vectors[k];
    }
    return result;
}

Array from_matrices(std::span<const Mat3> matrices) {
    Array result({static_cast<py::ssize_t>(matrices.size()), py::ssize_t{3}, py::ssize_t{3}});
    for (std::size_t k = 0; k < matrices.size(); ++k) {
        Eigen::Map<RowMajor3>(result.mutable_data() + 9 * k) = matrices[k];
    }
    return result;
}

/// A field whose samples come from a Python callable: sampler(points (n, 3), moments (n, 3), order) returns a
/// tuple of the first order + 1 of flux (n, 3), gradient (n, 3, 3) and contracted curvature (n, 3, 3).
class PythonField final : public AppliedField {
  public:
    explicit PythonField(py::function sampler) : sampler_(std::move(sampler)) {}
    ~PythonField() override {  // the last owner may be C++ code that has released the GIL
        const py::gil_scoped_acquire gil;
        sampler_ = py::function();
    }

    std::string_view name() const override { return "Python field"; }
    bool needs_gil() const override { return true; }

    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const override {
        if (points.empty()) return;
        const py::gil_scoped_acquire gil;
        const py::tuple samples = call_python(sampler_, from_vectors(points), from_vectors(moments), order);
        if (samples.size() != static_cast<std::size_t>(order) + 1) {
            throw InvalidInput(
                "a Python field must return one array for each of flux, gradient and curvature");
        }
        const auto count = static_cast<py::ssize_t>(points.size());
        const Array flux = checked(samples[0], {count, 3});
        for (py::ssize_t k = 0; k < count; ++k)
            out.flux[k] += scale * Eigen::Map<const Vec3>(flux.data(k, 0));
        if (order >= 1) add_matrices(checked(samples[1], {count, 3, 3}), scale, out.gradient);
        if (order >= 2) add_matrices(checked(samples[2], {count, 3, 3}), scale, out.curvature);
    }

  private:
    static Array checked(const py::handle& value, const std::vector<py::ssize_t>& shape) {
        const Array array = py::cast<Array>(value);
        if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) {
            throw InvalidInput("a Python field returned an array of the wrong shape");
        }
        return array;
    }

    static void add_matrices(const Array& matrices, double scale, std::vector<Mat3>& out) {
        for (std::size_t k = 0; k < out.size(); ++k) {
            out[k] += scale * Eigen::Map<const RowMajor3>(matrices.data() + 9 * k);
        }
    }

    py::function sampler_;
};

py::tuple sample_fields(const std::vector<std::shared_ptr<AppliedField>>& fields,
                        const std::vector<double>& scales, const Array& points, const Array& moments,
                        int order) {
    const std::vector<Vec3> x = to_vectors(points, "points"), m = to_vectors(moments, "moments");
    if (order < 0 || order > 2) throw InvalidInput("order must be 0, 1 or 2, got " + std::to_string(order));
    if (m.size() != x.size() || scales.size() != fields.size()) {
        throw InvalidInput("there must be one moment a point and one scale a field");
    }
    FieldSamples samples;
    samples.reset(x.size(), order);
    {
        const py::gil_scoped_release release;
        for (std::size_t f = 0; f < fields.size(); ++f)
            fields[f]->add_samples(x, m, order, scales[f], samples);
    }
    return py::make_tuple(from_vectors(samples.flux), from_matrices(samples.gradient),
                          from_matrices(samples.curvature));
}

py::array_t<double> fine_face_points() {
    py::array_t<double> rows({static_cast<py::ssize_t>(face_points::fine.size()), py::ssize_t{5}});
    auto at = rows.mutable_unchecked<2>();
    for (py::ssize_t k = 0; k < at.shape(0); ++k) {
        const FacePoint& point = face_points::fine[k];
        for (int i = 0; i < 3; ++i) at(k, i) = point.at[i];
        at(k, 3) = point.height;
        at(k, 4) = point.weight;
    }
    return rows;
}

std::shared_ptr<SampledField> make_sampled_field(const std::array<double, 3>& origin,
                                                 const std::array<double, 3>& spacing,
                                                 const Array& flux_density) {
    if (flux_density.ndim() != 4) throw InvalidInput("flux_density must have shape (nx, ny, nz, 3)");
    const std::array<Index, 3> samples = {static_cast<Index>(flux_density.shape(0)),
                                          static_cast<Index>(flux_density.shape(1)),
                                          static_cast<Index>(flux_density.shape(2))};
    return std::make_shared<SampledField>(Vec3(origin.data()), Vec3(spacing.data()), samples,
                                          to_vectors(flux_density, "flux_density"));
}

}  // namespace

void register_field(py::module_& module) {
    module.attr("vacuum_permeability") = vacuum_permeability;

    py::class_<AppliedField, std::shared_ptr<AppliedField>>(module, "AppliedField")
        .def_property_readonly("name", &AppliedField::name)
        .def_property_readonly("needs_gil", &AppliedField::needs_gil);

    py::class_<Dipoles, AppliedField, std::shared_ptr<Dipoles>>(module, "Dipoles")
        .def(py::init([](const Array& positions, const Array& moments) {
                 return std::make_shared<Dipoles>(to_vectors(positions, "positions"),
                                                  to_vectors(moments, "moments"));
             }),
             py::arg("positions"), py::arg("moments"));

    using Numbers = std::array<double, 3>;
    py::class_<CuboidMagnet, AppliedField, std::shared_ptr<CuboidMagnet>>(module, "CuboidMagnet")
        .def(py::init([](const Numbers& dimensions, const Numbers& magnetization, const Numbers& center,
                         const Numbers& rotation) {
                 return std::make_shared<CuboidMagnet>(Cuboid(Vec3(dimensions.data())),
                                                       Vec3(magnetization.data()), Vec3(center.data()),
                                                       Vec3(rotation.data()));
             }),
             py::arg("dimensions"), py::arg("remanent_magnetization"), py::arg("center"),
             py::arg("rotation"));
    py::class_<CylinderMagnet, AppliedField, std::shared_ptr<CylinderMagnet>>(module, "CylinderMagnet")
        .def(py::init([](double radius, double height, const Numbers& magnetization, const Numbers& center,
                         const Numbers& rotation) {
                 return std::make_shared<CylinderMagnet>(Cylinder(radius, height), Vec3(magnetization.data()),
                                                         Vec3(center.data()), Vec3(rotation.data()));
             }),
             py::arg("radius"), py::arg("height"), py::arg("remanent_magnetization"), py::arg("center"),
             py::arg("rotation"));

    py::class_<SampledField, AppliedField, std::shared_ptr<SampledField>>(module, "SampledField")
        .def(py::init(&make_sampled_field), py::arg("origin"), py::arg("spacing"), py::arg("flux_density"))
        .def(
            "contains",
            [](const SampledField& field, const Array& points) {
                std::vector<bool> inside;
                for (const Vec3& x : to_vectors(points, "points")) inside.push_back(field.contains(x));
                return inside;
            },
            py::arg("points"));

    py::class_<PythonField, AppliedField, std::shared_ptr<PythonField>>(module, "PythonField")
        .def(py::init<py::function>(), py::arg("sampler"));

    py::class_<PosedField, AppliedField, std::shared_ptr<PosedField>>(module, "PlacedField")
        .def(
            py::init([](std::shared_ptr<AppliedField> field, const Numbers& center, const Numbers& rotation) {
                return std::make_shared<PosedField>(std::move(field), Vec3(center.data()),
                                                    Vec3(rotation.data()));
            }),
            py::arg("field"), py::arg("center"), py::arg("rotation"));

    module.def("fine_face_points", &fine_face_points,
               "The points at which a face near a source samples the field: barycentric coordinates, height "
               "over the "
               "thickness, weight, (n, 5).");
    module.def(
        "sample_fields", &sample_fields, py::arg("fields"), py::arg("scales"), py::arg("points"),
        py::arg("moments"), py::arg("order"),
        "The sum of scale * field at the points (n, 3) [m]: flux density, gradient, and second derivative "
        "contracted with the moments (n, 3); empty beyond the order.");
}

}  // namespace magshell::bindings
