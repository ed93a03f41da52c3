// The points of elements of an OwnField by their coordinates a and b in an ElementPose (energy/own_field_poses.h).
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {
namespace own_field {

/// The points of an element in rows with the same a.
template <class Number>
class PointRows {
  public:
    struct Point {
        Number coordinate, weight;  // b, w
    };
    struct Row {
        Number coordinate;  // a
        int first, last;
    };

    explicit PointRows(const GaussRule& of_edge) {
        for (int i = 0; i < of_edge.count; ++i)
            for (int j = 0; j < of_edge.count; ++j)
                add(of_edge.points[i] - 0.5, of_edge.points[j] - 0.5,
                    of_edge.weights[i] * of_edge.weights[j]);
    }
    /// The points of a triangle, given by barycentric coordinates.
    explicit PointRows(std::vector<FacePoint> of_triangle) {
        std::stable_sort(of_triangle.begin(), of_triangle.end(),
                         [](const FacePoint& p, const FacePoint& q) { return p.at[1] < q.at[1]; });
        for (const FacePoint& point : of_triangle)
            add(point.at[1] - 1.0 / 3.0, point.at[2] - 1.0 / 3.0, point.weight);
    }

    const Row* begin() const { return rows_.data(); }
    const Row* end() const { return rows_.data() + n_rows_; }
    const Point& operator[](int k) const { return points_[k]; }

  private:
    static constexpr int most = 16;

    void add(double a, double b, double weight) {
        const Number coordinate = static_cast<Number>(a);
        if (n_rows_ == 0 || rows_[n_rows_ - 1].coordinate != coordinate)
            rows_[n_rows_++] = {coordinate, n_points_, n_points_};
        points_[n_points_++] = {static_cast<Number>(b), static_cast<Number>(weight)};
        rows_[n_rows_ - 1].last = n_points_;
    }

    std::array<Row, most> rows_;
    std::array<Point, most> points_;
    int n_rows_ = 0, n_points_ = 0;
};

/// The points of both kinds of elements by a rule.
template <class Number>
struct ElementRows {
    PointRows<Number> of_edge, of_triangle;

    explicit ElementRows(const GaussRule& rule) : of_edge(rule), of_triangle(points_of_triangle(rule)) {}
    const PointRows<Number>& operator()(bool edge) const { return edge ? of_edge : of_triangle; }
};

}  // namespace own_field
}  // namespace magshell
