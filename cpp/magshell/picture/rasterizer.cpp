#include "magshell/picture/rasterizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace magshell {
namespace {

constexpr double smooth_below = 0.76604444311897803;  // [-] cosine of 40 degrees
constexpr double overlap = 1e-9;         // [-] of a sample: neighbours share it rather than leave a gap
constexpr Index band_samples = 1 << 22;  // samples whose depths and colours are in memory at a time

constexpr float nothing = -std::numeric_limits<float>::infinity();  // the depth of the background

// A triangle in samples from the top left corner, with the quantities that vary over it.
struct Triangle {
    std::array<Vec3, 3> corners, normals, colors;
    double opacity, depth;
    bool lit, plain;  // plain: one normal and one colour for all of it
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
    if (!surface.smooth) return normals;
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

// Appends the triangles of a surface that are in the frame.
void append(const PaintedTriangles& surface, const Frame& frame, std::vector<Triangle>& out) {
    const std::vector<std::array<Vec3, 3>> normals = corner_normals(surface);
    const double across = frame.samples * frame.width / (frame.right - frame.left),
                 down = frame.samples * frame.height / (frame.top - frame.bottom);
    const double last_column = frame.samples * frame.width, last_row = frame.samples * frame.height;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        Triangle triangle{.corners = {},
                          .normals = normals[f],
                          .colors = surface.colors[f],
                          .opacity = surface.opacity,
                          .depth = 0.0,
                          .lit = surface.lit,
                          .plain = false};
        Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
        for (int k = 0; k < 3; ++k) {
            const Vec3& x = surface.positions[surface.faces[f][k]];
            triangle.corners[k] = Vec3((x.x() - frame.left) * across, (frame.top - x.y()) * down, x.z());
            triangle.depth += x.z() / 3.0;
            low = low.cwiseMin(triangle.corners[k]);
            high = high.cwiseMax(triangle.corners[k]);
        }
        if (!(low.x() < last_column && high.x() > 0.0 && low.y() < last_row && high.y() > 0.0)) continue;
        const auto same = [](const std::array<Vec3, 3>& v) { return v[0] == v[1] && v[0] == v[2]; };
        triangle.plain = same(triangle.colors) && (!triangle.lit || same(triangle.normals));
        out.push_back(triangle);
    }
}

class Band {
  public:
    Band(const Frame& frame, const Lighting& lighting)
        : frame_(frame), lighting_(lighting), columns_(Index(frame.samples) * frame.width) {}

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
    Vec3 shaded(const Vec3& color, Vec3 normal) const {
        if (normal.z() < 0.0) normal = -normal;
        const double towards = std::max(normal.dot(lighting_.direction), 0.0);
        return color * (lighting_.ambient + lighting_.diffuse * towards);
    }

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
        const Vec3 plain =
            triangle.lit ? shaded(triangle.colors[0], triangle.normals[0]) : triangle.colors[0];
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
            for (Index column = begin; column <= end; ++column) {
                const double x = column + 0.5;
                const double s = u[0] + v[0] * x, t = u[1] + v[1] * x, r = u[2] + v[2] * x;
                const float depth = static_cast<float>(s * a.z() + t * b.z() + r * c.z());
                const std::size_t at = start + column;
                if (!(depth > depths_[at])) continue;
                put(triangle, at, depth, triangle.plain ? plain : color_at(triangle, s, t, r));
            }
        }
    }

    Vec3 color_at(const Triangle& triangle, double s, double t, double r) const {
        const Vec3 color = s * triangle.colors[0] + t * triangle.colors[1] + r * triangle.colors[2];
        if (!triangle.lit) return color;
        const Vec3 normal = s * triangle.normals[0] + t * triangle.normals[1] + r * triangle.normals[2];
        return shaded(color, normal / std::max(normal.norm(), 1e-30));
    }

    void put(const Triangle& triangle, std::size_t at, float depth, const Vec3& color) {
        std::uint8_t* to = colors_.data() + 3 * at;
        if (triangle.opacity >= 1.0) depths_[at] = depth;
        for (int k = 0; k < 3; ++k) {
            const double own = 255.0 * std::clamp(color[k], 0.0, 1.0);
            to[k] = static_cast<std::uint8_t>(to[k] + triangle.opacity * (own - to[k]) + 0.5);
        }
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
    const Lighting& lighting_;
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
        append(surface, frame, surface.opacity < 1.0 ? clear : solid);
    std::ranges::stable_sort(clear, {}, &Triangle::depth);
    solid.insert(solid.end(), clear.begin(), clear.end());
    std::vector<std::uint8_t> pixels(4 * std::size_t(frame.width) * frame.height, 255);
    const Index row_samples = Index(frame.width) * frame.samples * frame.samples;
    const int rows = std::max(1, static_cast<int>(band_samples / row_samples));
    Band band(frame, lighting);
    for (int first = 0; first < frame.height; first += rows)
        band.paint(solid, first, std::min(frame.height, first + rows),
                   pixels.data() + 4 * std::size_t(first) * frame.width);
    return pixels;
}

}  // namespace magshell
