#include "magshell/picture/rasterizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace magshell {
namespace {

constexpr double degree = 0.017453292519943295;
constexpr double overlap = 1e-9;         // [-] of a sample: neighbours share it rather than leave a gap
constexpr Index band_samples = 1 << 22;  // samples whose depths and colours are in memory at a time

constexpr float nothing = -std::numeric_limits<float>::infinity();  // the depth of the background

// A triangle in samples from the top left corner, with the colours of its corners from 0 to 255, shading included. Surfaces are
// matt, so that colours vary nearly linearly over a triangle.
struct Triangle {
    std::array<Vec3, 3> corners, colors;
    double opacity, depth;
};

Vec3 scaled_normal(const std::vector<Vec3>& x, const std::array<Index, 3>& face) {
    return (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
}

// Returns the unit normal at each corner of each face.
std::vector<std::array<Vec3, 3>> corner_normals(const PaintedTriangles& surface) {
    std::vector<Vec3> weighted, units;
    for (const std::array<Index, 3>& face : surface.faces) {
        weighted.push_back(scaled_normal(surface.positions, face));
        const double length = weighted.back().norm();
        units.push_back(length > 0.0 ? Vec3(weighted.back() / length) : Vec3(Vec3::UnitZ()));
    }
    std::vector<std::array<Vec3, 3>> normals;
    for (const Vec3& unit : units) normals.push_back({unit, unit, unit});
    if (surface.crease <= 0.0) return normals;
    const double smooth_below = std::cos(surface.crease * degree);
    std::vector<std::vector<Index>> around(surface.positions.size());
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
        for (const Index vertex : surface.faces[f]) around[vertex].push_back(static_cast<Index>(f));
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
        for (int k = 0; k < 3; ++k) {
            Vec3 sum = Vec3::Zero();
            for (const Index other : around[surface.faces[f][k]])
                if (units[other].dot(units[f]) > smooth_below) sum += weighted[other];
            if (const double length = sum.norm(); length > 0.0) normals[f][k] = sum / length;
        }
    return normals;
}

// Returns the colours from 0 to 255 of the corners of a face, as the light shows its side towards the eye.
std::array<Vec3, 3> shaded(const std::array<Vec3, 3>& colors, const std::array<Vec3, 3>& normals,
                           const Vec3& normal, const Lighting* lighting) {
    std::array<Vec3, 3> out;
    for (int k = 0; k < 3; ++k) {
        double light = 1.0;
        if (lighting) {
            const double towards = (normal.z() < 0.0 ? -1.0 : 1.0) * normals[k].dot(lighting->direction);
            light = lighting->ambient + lighting->diffuse * std::max(towards, 0.0);
        }
        out[k] = (255.0 * light * colors[k]).cwiseMax(0.0).cwiseMin(255.0);
    }
    return out;
}

// Appends the triangles of a surface that are in the frame.
void append(const PaintedTriangles& surface, const Frame& frame, const Lighting& lighting,
            std::vector<Triangle>& out) {
    const std::vector<std::array<Vec3, 3>> normals = corner_normals(surface);
    const double across = frame.samples * frame.width / (frame.right - frame.left),
                 down = frame.samples * frame.height / (frame.top - frame.bottom);
    const double last_column = frame.samples * frame.width, last_row = frame.samples * frame.height;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const Vec3 normal = scaled_normal(surface.positions, surface.faces[f]);
        Triangle triangle{
            .corners = {},
            .colors = shaded(surface.colors[f], normals[f], normal, surface.lit ? &lighting : nullptr),
            .opacity = surface.opacity,
            .depth = 0.0};
        Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
        for (int k = 0; k < 3; ++k) {
            const Vec3& x = surface.positions[surface.faces[f][k]];
            triangle.corners[k] = Vec3((x.x() - frame.left) * across, (frame.top - x.y()) * down, x.z());
            triangle.depth += x.z() / 3.0;
            low = low.cwiseMin(triangle.corners[k]);
            high = high.cwiseMax(triangle.corners[k]);
        }
        if (!(low.x() < last_column && high.x() > 0.0 && low.y() < last_row && high.y() > 0.0)) continue;
        out.push_back(triangle);
    }
}

class Band {
  public:
    explicit Band(const Frame& frame) : frame_(frame), columns_(Index(frame.samples) * frame.width) {}

    // Paints rows of pixels from `first` to `last` - 1, which are white.
    void paint(const std::vector<Triangle>& triangles, int first, int last, std::uint8_t* pixels) {
        top_ = first * frame_.samples;
        bottom_ = last * frame_.samples;
        const std::size_t samples = std::size_t(columns_) * (bottom_ - top_);
        if (depths_.size() < samples) {
            depths_.resize(samples, nothing);
            colors_.resize(3 * samples, 255);
        }
        touched_.assign(bottom_ - top_, {columns_, -1});
        for (const Triangle& triangle : triangles) fill(triangle);
        average(first, last, pixels);
        for (std::size_t row = 0; row < touched_.size(); ++row) {
            const auto [begin, end] = touched_[row];
            if (end < begin) continue;
            std::fill_n(depths_.begin() + row * columns_ + begin, end - begin + 1, nothing);
            std::fill_n(colors_.begin() + 3 * (row * columns_ + begin), 3 * (end - begin + 1), 255);
        }
    }

  private:
    void fill(const Triangle& triangle) {
        const auto& [a, b, c] = triangle.corners;
        const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
        if (area == 0.0) return;
        const double low = std::min({a.y(), b.y(), c.y()}), high = std::max({a.y(), b.y(), c.y()});
        const int from = std::max(top_,
                                  static_cast<int>(std::ceil(std::max(low, double(top_)) - 0.5 - overlap))),
                  to =
                      std::min(bottom_ - 1,
                               static_cast<int>(std::floor(std::min(high, double(bottom_)) - 0.5 + overlap)));
        for (int row = from; row <= to; ++row) {
            // Barycentric coordinates are u_k + v_k x along the row, and all of them positive inside.
            const double y = row + 0.5;
            double left = 0.0, right = static_cast<double>(columns_);
            std::array<double, 3> u, v;
            for (int k = 0; k < 3; ++k) {
                const Vec3 &p = triangle.corners[(k + 1) % 3], &q = triangle.corners[(k + 2) % 3];
                v[k] = -(q.y() - p.y()) / area;
                u[k] = ((q.x() - p.x()) * (y - p.y()) + (q.y() - p.y()) * p.x()) / area;
                if (v[k] > 0.0)
                    left = std::max(left, -u[k] / v[k]);
                else if (v[k] < 0.0)
                    right = std::min(right, -u[k] / v[k]);
                else if (u[k] < 0.0)
                    right = -1.0;
            }
            const Index begin = static_cast<Index>(std::max(0.0, std::ceil(left - 0.5 - overlap))),
                        end = static_cast<Index>(std::min(columns_ - 1.0, std::floor(right - 0.5 + overlap)));
            if (end < begin) continue;
            const std::size_t start = std::size_t(row - top_) * columns_;
            auto& [leftmost, rightmost] = touched_[row - top_];
            leftmost = std::min(leftmost, begin);
            rightmost = std::max(rightmost, end);
            // Depth and colours are linear along the row.
            const double x = static_cast<double>(begin) + 0.5;
            const std::array<double, 3> share{u[0] + v[0] * x, u[1] + v[1] * x, u[2] + v[2] * x};
            const double depth = share[0] * a.z() + share[1] * b.z() + share[2] * c.z(),
                         deeper = v[0] * a.z() + v[1] * b.z() + v[2] * c.z();
            const auto& [p, q, r] = triangle.colors;
            const Vec3 color = share[0] * p + share[1] * q + share[2] * r,
                       brighter = v[0] * p + v[1] * q + v[2] * r;
            const Painter painter{depth, deeper, color.cast<float>(), brighter.cast<float>()};
            if (triangle.opacity >= 1.0)
                cover(painter, start + begin, end - begin + 1);
            else
                blend(painter, start + begin, end - begin + 1, static_cast<float>(triangle.opacity));
        }
    }

    // Depth and colour at the first sample of a row, and their changes from one sample to the next.
    struct Painter {
        double depth, deeper;
        Eigen::Vector3f color, brighter;
    };

    void cover(const Painter& painter, std::size_t first, Index count) {
        float* depths = depths_.data() + first;
        std::uint8_t* to = colors_.data() + 3 * first;
        for (Index n = 0; n < count; ++n, to += 3) {
            const float depth = static_cast<float>(painter.depth + painter.deeper * static_cast<double>(n));
            if (!(depth > depths[n])) continue;
            depths[n] = depth;
            const float along = static_cast<float>(n);
            for (int k = 0; k < 3; ++k) to[k] = byte(painter.color[k] + along * painter.brighter[k]);
        }
    }

    void blend(const Painter& painter, std::size_t first, Index count, float opacity) {
        const float* depths = depths_.data() + first;
        std::uint8_t* to = colors_.data() + 3 * first;
        for (Index n = 0; n < count; ++n, to += 3) {
            if (!(static_cast<float>(painter.depth + painter.deeper * static_cast<double>(n)) > depths[n]))
                continue;
            const float along = static_cast<float>(n);
            for (int k = 0; k < 3; ++k) {
                const float before = to[k], own = painter.color[k] + along * painter.brighter[k];
                to[k] = byte(before + opacity * (own - before));
            }
        }
    }

    // Rounds a colour from 0 to 255, which rounding may have moved a little beyond these ends.
    static std::uint8_t byte(float color) {
        return static_cast<std::uint8_t>(std::clamp(static_cast<int>(color + 0.5F), 0, 255));
    }

    void average(int first, int last, std::uint8_t* pixels) const {
        const int n = frame_.samples, all = n * n;
        for (int row = first; row < last; ++row) {
            Index begin = columns_, end = -1;
            for (int i = 0; i < n; ++i) {
                begin = std::min(begin, touched_[(row - first) * n + i].first);
                end = std::max(end, touched_[(row - first) * n + i].second);
            }
            for (Index column = begin / n; column <= end / n && end >= begin; ++column) {
                std::array<int, 3> sum{};
                for (int i = 0; i < n; ++i) {
                    const std::uint8_t* from =
                        colors_.data() +
                        3 * (std::size_t((row - first) * n + i) * columns_ + std::size_t(column) * n);
                    for (int j = 0; j < 3 * n; ++j) sum[j % 3] += from[j];
                }
                std::uint8_t* to = pixels + 4 * (std::size_t(row - first) * frame_.width + column);
                for (int k = 0; k < 3; ++k) to[k] = static_cast<std::uint8_t>((2 * sum[k] + all) / (2 * all));
            }
        }
    }

    const Frame& frame_;
    const Index columns_;
    int top_ = 0, bottom_ = 0;  // the rows of samples
    std::vector<float> depths_;
    std::vector<std::uint8_t> colors_;
    std::vector<std::pair<Index, Index>>
        touched_;  // by row: the first and last sample that a triangle was painted on
};

}  // namespace

std::vector<std::uint8_t> rasterized(std::span<const PaintedTriangles> surfaces, const Frame& frame,
                                     const Lighting& lighting) {
    std::vector<Triangle> solid, clear;
    for (const PaintedTriangles& surface : surfaces)
        append(surface, frame, lighting, surface.opacity < 1.0 ? clear : solid);
    std::ranges::stable_sort(clear, {}, &Triangle::depth);
    solid.insert(solid.end(), clear.begin(), clear.end());
    std::vector<std::uint8_t> pixels(4 * std::size_t(frame.width) * frame.height, 255);
    const Index row_samples = Index(frame.width) * frame.samples * frame.samples;
    const int rows = std::max(1, static_cast<int>(band_samples / row_samples));
    Band band(frame);
    for (int first = 0; first < frame.height; first += rows)
        band.paint(solid, first, std::min(frame.height, first + rows),
                   pixels.data() + 4 * std::size_t(first) * frame.width);
    return pixels;
}

}  // namespace magshell
