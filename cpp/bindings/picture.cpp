// Binds the painting of triangles into images.
#include <algorithm>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/picture/rasterizer.h"

namespace magshell::bindings {
namespace {

PaintedTriangles painted(const py::handle& given) {
    PaintedTriangles surface;
    const Array positions = given["positions"].cast<Array>(), colors = given["colors"].cast<Array>();
    const IndexArray faces = given["faces"].cast<IndexArray>();
    const bool per_face = given["per_face"].cast<bool>();
    for (py::ssize_t k = 0; k < positions.shape(0); ++k)
        surface.positions.emplace_back(Vec3(positions.data(k, 0)));
    for (py::ssize_t f = 0; f < faces.shape(0); ++f) {
        surface.faces.push_back({faces.at(f, 0), faces.at(f, 1), faces.at(f, 2)});
        std::array<Vec3, 3>& of_corners = surface.colors.emplace_back();
        for (int k = 0; k < 3; ++k) of_corners[k] = Vec3(colors.data(per_face ? f : faces.at(f, k), 0));
    }
    surface.lit = given["lit"].cast<bool>();
    surface.crease = given["crease"].cast<double>();
    surface.opacity = given["opacity"].cast<double>();
    return surface;
}

}  // namespace

void register_picture(py::module_& module) {
    module.def(
        "rasterized",
        [](const py::list& surfaces, std::array<double, 4> window, int width, int height, int samples,
           std::array<double, 3> light, double ambient, double diffuse) {
            std::vector<PaintedTriangles> all;
            for (const py::handle& each : surfaces) all.push_back(painted(each));
            const Frame frame{window[0], window[1], window[2], window[3], width, height, samples};
            const Lighting lighting{Vec3(light.data()).normalized(), ambient, diffuse};
            std::vector<std::uint8_t> pixels;
            {
                const py::gil_scoped_release release;
                pixels = rasterized(all, frame, lighting);
            }
            py::array_t<std::uint8_t> image({height, width, 4});
            std::ranges::copy(pixels, image.mutable_data());
            return image;
        },
        py::arg("surfaces"), py::arg("window"), py::arg("width"), py::arg("height"), py::kw_only(),
        py::arg("samples"), py::arg("light"), py::arg("ambient"), py::arg("diffuse"),
        "Paints triangles into an image (height, width, 4). surfaces: dictionaries with positions (n, 3) m "
        "on "
        "the screen "
        "and in depth, faces, colors, per_face, lit, crease (degrees) and opacity. window: (left, right, "
        "bottom, top) "
        "m.");
}

}  // namespace magshell::bindings
