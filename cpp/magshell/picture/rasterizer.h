// Paints triangles into an image by a depth buffer, with a parallel projection along z; no graphics driver is needed.
//
// Coordinates are those of the screen [m]: x to the right, y up, z towards the eye. Each pixel is the mean of a square of samples.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// A light far away, and how matt surfaces reflect it: ambient + diffuse * cos(angle between normal and light).
struct Lighting {
    Vec3 direction;  // towards the light, a unit vector
    double ambient, diffuse;
};

/// Triangles with colours from 0 to 1, per corner of each.
struct PaintedTriangles {
    std::vector<Vec3> positions;
    std::vector<std::array<Index, 3>> faces;
    std::vector<std::array<Vec3, 3>> colors;  // of the corners of each face
    bool lit = true;
    double crease =
        0.0;  // degrees: normals are averaged over the faces at a vertex that meet at a smaller angle
    double opacity = 1.0;
};

/// Where a picture begins and ends [m], and its size in pixels.
struct Frame {
    double left, right, bottom, top;
    int width, height;
    int samples;  // along each side of a pixel
};

/// Returns the colours of the pixels, row by row from the top, 4 bytes each: red, green, blue, 255. The background is white. Transparent triangles are painted
/// after all others, the farthest first.
std::vector<std::uint8_t> rasterized(std::span<const PaintedTriangles> surfaces, const Frame& frame,
                                     const Lighting& lighting);

}  // namespace magshell
