// The points of elements of an OwnField by their coordinates a and b in an ElementPose (energy/own_field_poses.h).
#pragma once

#include <array>
#include <vector>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {
namespace own_field {

template <class Number>
struct ElementPoint {
    Number weight, a, b, aa, ab, bb;  // the products of a and b
};

/// The points of an edge or of a triangle by a rule.
template <class Number>
class ElementPoints {
  public:
    static constexpr int most = 16;

    explicit ElementPoints(const GaussRule& of_edge) {
        for (int i = 0; i < of_edge.count; ++i)
            for (int j = 0; j < of_edge.count; ++j)
                add(of_edge.points[i] - 0.5, of_edge.points[j] - 0.5,
                    of_edge.weights[i] * of_edge.weights[j]);
    }
    explicit ElementPoints(const std::vector<FacePoint>& of_triangle) {
        for (const FacePoint& point : of_triangle)
            add(point.at[1] - 1.0 / 3.0, point.at[2] - 1.0 / 3.0, point.weight);
    }

    int count() const { return count_; }
    const ElementPoint<Number>& operator[](int k) const { return points_[k]; }

  private:
    void add(double a, double b, double weight) {
        const auto number = [](double each) { return static_cast<Number>(each); };
        points_[count_++] = {number(weight), number(a),     number(b),
                             number(a * a),  number(a * b), number(b * b)};
    }

    std::array<ElementPoint<Number>, most> points_;
    int count_ = 0;
};

/// The points of both kinds of elements by a rule.
template <class Number>
struct PointsOfKinds {
    ElementPoints<Number> of_edge, of_triangle;

    explicit PointsOfKinds(const GaussRule& rule) : of_edge(rule), of_triangle(points_of_triangle(rule)) {}
    const ElementPoints<Number>& operator()(bool edge) const { return edge ? of_edge : of_triangle; }
};

}  // namespace own_field
}  // namespace magshell
