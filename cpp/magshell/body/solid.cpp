#include "magshell/body/solid.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "magshell/body/width.h"
#include "magshell/core/errors.h"
#include "magshell/mesh/space_filling_order.h"
#include "magshell/strain/tetrahedron.h"

namespace magshell {

Solid::Solid(std::string owner_, const Rows3& rest_positions, const std::vector<Index>& given,
             int nodes_per_element, const std::vector<Index>& vertices, const SolidSurface& surface,
             NodeNumbering& numbering)
    : owner(std::move(owner_)), width_(nodes_per_element) {
    if (width_ != 4 && width_ != 10)
        throw InvalidInput("a tetrahedron has 4 or 10 nodes, got " + std::to_string(width_));
    const Index count = static_cast<Index>(given.size()) / width_;
    if (count == 0) throw InvalidInput("a solid needs at least one tetrahedron");
    for (const Index node : given)
        if (node < 0 || node >= rest_positions.rows())
            throw InvalidInput("a tetrahedron has node " + std::to_string(node) + ", but there are " +
                               std::to_string(rest_positions.rows()));
    std::vector<Vec3> middles(count, Vec3::Zero());
    for (Index t = 0; t < count; ++t)
        for (int k = 0; k < 4; ++k)
            middles[t] += 0.25 * rest_positions.row(given[t * width_ + k]).transpose();
    elements = order_along_curve(middles);
    rest_.resize(given.size());
    const auto number = [&](auto& nodes) {
        nodes.resize(count);
        for (Index t = 0; t < count; ++t)
            for (int k = 0; k < width_; ++k) {
                const Index node = given[elements.user[t] * width_ + k];
                rest_[t * width_ + k] = rest_positions.row(node).transpose();
                nodes[t][k] = numbering.number(vertices[node], rest_[t * width_ + k]);
            }
    };
    if (width_ == 4) {
        number(linear_nodes);
        check_volumes<LinearTetrahedron>();
    } else {
        number(quadratic_nodes);
        check_volumes<QuadraticTetrahedron>();
    }
    if (surface.mesh) surface_ = std::make_unique<Surface>(owner, *surface.mesh, surface.vertices, numbering);
}

template <class Element>
void Solid::check_volumes() const {
    Index first = n_elements();
    double volume = 0.0;
    for (Index t = 0; t < n_elements(); ++t) {
        const RestElement<Element> at(&rest_[t * width_]);
        const double least = *std::min_element(at.volume, at.volume + Element::points);
        if (!(least > 0.0) && elements.user[t] < first) {
            first = elements.user[t];
            volume = least;
        }
    }
    if (first < n_elements())
        throw InvalidInput("tetrahedron " + std::to_string(first) +
                           " is flat or inverted at rest: its volume at an integration point is " +
                           std::to_string(volume) + " m3");
}

double Solid::extent() const {
    WeightedCenter center;
    for (Index t = 0; t < n_elements(); ++t) {
        const Vec3* x = &rest_[t * width_];
        center.add(volume_of(t), (x[0] + x[1] + x[2] + x[3]) / 4.0);
    }
    return width_about(center.mean(), std::span(&rest_, 1));
}

double Solid::volume_of(Index element) const {
    const Vec3* x = &rest_[element * width_];
    return (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]) / 6.0;
}

double Solid::volume() const {
    double sum = 0.0;
    for (Index t = 0; t < n_elements(); ++t) sum += volume_of(t);
    return sum;
}

double Solid::smallest_height() const {
    double least = extent();
    for (Index t = 0; t < n_elements(); ++t) {
        const Vec3* x = &rest_[t * width_];
        double largest_face = 0.0;
        for (int k = 0; k < 4; ++k) {
            const Vec3 &a = x[(k + 1) % 4], &b = x[(k + 2) % 4], &c = x[(k + 3) % 4];
            largest_face = std::max(largest_face, 0.5 * (b - a).cross(c - a).norm());
        }
        least = std::min(least, 3.0 * std::abs(volume_of(t)) / largest_face);
    }
    return least;
}

void Solid::add_volumes(VectorXd& metric) const {
    for (Index t = 0; t < n_elements(); ++t)
        for (const Index node : nodes_of(t)) metric.segment<3>(3 * node).array() += volume_of(t) / width_;
}

}  // namespace magshell
