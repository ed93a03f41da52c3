// The forces between near elements of different bodies, at the points of an OwnField and as they are: those of one element by a closed form at
// twice as many points along each direction of the other.
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

namespace {

// [-] The distance of two elements, over the larger size, from which on their points are enough: the force on an edge of four points beside
// another is off by 0.3 % there; fixed by test_near_sheets_are_warned_of_where_their_force_is_off.
constexpr double enough = 0.5;

// Two intervals of four Gauss points.
constexpr std::array<double, 8> points_8 = [] {
    std::array<double, 8> points{};
    for (int k = 0; k < 8; ++k) points[k] = 0.5 * (points_4[k % 4] + (k < 4 ? 0.0 : 1.0));
    return points;
}();
constexpr std::array<double, 8> weights_8 = [] {
    std::array<double, 8> weights{};
    for (int k = 0; k < 8; ++k) weights[k] = 0.5 * weights_4[k % 4];
    return weights;
}();
constexpr GaussRule finer{8, points_8.data(), weights_8.data()};

// The corners of the quarters of a triangle in barycentric coordinates.
constexpr double quarters[4][3][3] = {{{1, 0, 0}, {0.5, 0.5, 0}, {0.5, 0, 0.5}},
                                      {{0.5, 0.5, 0}, {0, 1, 0}, {0, 0.5, 0.5}},
                                      {{0.5, 0, 0.5}, {0, 0.5, 0.5}, {0, 0, 1}},
                                      {{0, 0.5, 0.5}, {0.5, 0, 0.5}, {0.5, 0.5, 0}}};

using Corners = std::array<Vec3, 3>;

// Returns the integral of (p - x)/|p - x|^3 over the points x of a triangle: its conormals m_i times the integrals of 1/|p - x| along its
// sides, and its normal times the solid angle [Wilton84, VanOosterom83].
Vec3 pull_of_triangle(const Corners& corners, const Vec3& p) {
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    const Vec3 r[3] = {corners[0] - p, corners[1] - p, corners[2] - p};
    const double lengths[3] = {r[0].norm(), r[1].norm(), r[2].norm()};
    Vec3 pull = Vec3::Zero();
    double sum = lengths[0] * lengths[1] * lengths[2];
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Vec3 side = corners[j] - corners[i];
        const double length = side.norm(), both = lengths[i] + lengths[j];
        pull += std::log((both + length) / (both - length)) / length * side.cross(normal);
        sum += r[i].dot(r[j]) * lengths[k];
    }
    return pull - 2.0 * std::atan2(r[0].dot(r[1].cross(r[2])), sum) * normal;
}

// Returns the integral of dx x (p - x)/|p - x|^3 around a triangle, the field of a current along its sides.
Vec3 field_of_loop(const Corners& corners, const Vec3& p) {
    Vec3 field = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
        const Vec3 first = p - corners[i], second = p - corners[(i + 1) % 3];
        const double a = first.norm(), b = second.norm();
        field += (a + b) / (a * b * (a * b + first.dot(second))) * first.cross(second);
    }
    return field;
}

struct Points {
    std::vector<Vec3> at;
    std::vector<double> weights;
};

// Returns sum w_i w_j (p_i - p_j)/r^3 [1/m2]; lowers `nearest` to the least distance [m].
Vec3 sum_of_pulls(const Points& first, const Points& second, double& nearest) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < first.at.size(); ++i)
        for (std::size_t j = 0; j < second.at.size(); ++j) {
            const Vec3 r = first.at[i] - second.at[j];
            const double distance = r.norm();
            nearest = std::min(nearest, distance);
            sum += (first.weights[i] * second.weights[j] / (distance * distance * distance)) * r;
        }
    return sum;
}

}  // namespace

// The force on an element by another is mu_0/(4 pi) (Q Q' - I I' L . L') sum w_i w_j (p_i - p_j)/r^3, as in energy/own_field_near_pairs.cpp, and
// that on a charge by the sides of a face mu_0/(4 pi) Q I_f times the field of a current of 1 around it, as in energy/own_field_sides.cpp.
OwnField::GapForces OwnField::gap_forces(const double* q, const double* rest, const Neighbours& near,
                                         const std::vector<Index>& body_of_face,
                                         const std::vector<Index>& body_of_tetrahedron,
                                         Index n_bodies) const {
    const std::vector<double> none(n_bodies, 0.0), far(n_bodies, std::numeric_limits<double>::infinity());
    const std::vector<Vec3> zero(n_bodies, Vec3::Zero());
    GapForces found{{zero, zero, none}, {zero, zero, none}, zero, far, none, none, far};
    const std::vector<Triple<double>> x = positions<double>(q, nullptr),
                                      at_rest = positions<double>(rest, nullptr);
    const Geometry<double> at(*this, x), before(*this, at_rest);
    const auto body_of = [&](const Element& element) {
        return (element.is_edge() ? body_of_face : body_of_tetrahedron)[element.bodies[0]];
    };
    const auto points_of = [&](Index e, bool are_more) {
        Points points;
        if (elements_[e].is_edge() || !are_more) {
            at.each_point(e, are_more ? finer : fine,
                          [&](const SourcePoint<double>& point, const SamplePoint& sample) {
                              points.at.push_back(values_of(point.at));
                              points.weights.push_back(sample.weight);
                          });
            return points;
        }
        at.each_point(e, fine, [&](const SourcePoint<double>&, const SamplePoint& sample) {
            for (const auto& corners : quarters) {
                Vec3 place = Vec3::Zero();
                for (int i = 0; i < 3; ++i)
                    for (int k = 0; k < 3; ++k)
                        place += sample.weights[i] * corners[i][k] * values_of(x[elements_[e].nodes[k]]);
                points.at.push_back(place);
                points.weights.push_back(0.25 * sample.weight);
            }
        });
        return points;
    };
    // Returns the mean of (p - x)/|p - x|^3 over the points p of an element, at its finer points, and x of another [1/m2].
    const auto mean_pull = [&](Index on, Index of) {
        const Element& element = elements_[of];
        Vec3 ends[3], sum = Vec3::Zero();
        for (int i = 0; i < element.n_nodes(); ++i) ends[i] = values_of(x[element.nodes[i]]);
        std::vector<Corners> triangles;
        if (element.is_edge()) {  // a ribbon: two triangles of the same area
            const Vec3 level = 0.5 * element_thickness_[of] * values_of(at.element_normals[of]);
            triangles = {{ends[0] - level, ends[1] - level, ends[1] + level},
                         {ends[0] - level, ends[1] + level, ends[0] + level}};
        } else {
            triangles = {{ends[0], ends[1], ends[2]}};
        }
        const Points points = points_of(on, true);
        for (const Corners& corners : triangles) {
            const double area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
            const double part = 1.0 / (area * static_cast<double>(triangles.size()));
            for (std::size_t k = 0; k < points.at.size(); ++k)
                sum += part * points.weights[k] * pull_of_triangle(corners, points.at[k]);
        }
        return sum;
    };
    const auto shifted = [&](Index f, double zeta) {
        const Vec3 shift = zeta * thickness_[f] * values_of(at.normals[f]);
        Corners corners;
        for (int k = 0; k < 3; ++k) corners[k] = values_of(x[faces_[f].nodes[k]]) + shift;
        return corners;
    };
    // Returns the mean over the points of an element of the field of a face, over its current: of two layers of dipoles, or of its charged
    // sides [1/m].
    const auto field_of_face = [&](Index e, Index f, bool are_layers, double& nearest) {
        const Points points = points_of(e, !are_layers);
        Vec3 sum = Vec3::Zero();
        for (int k = 0; k < 2; ++k) {
            const Corners corners = shifted(f, are_layers ? coarse.points[k] - 0.5 : k - 0.5);
            const double part = are_layers ? coarse.weights[k] : (k - 0.5) * 2.0 / thickness_[f];
            for (std::size_t i = 0; i < points.at.size(); ++i) {
                const Vec3& p = points.at[i];
                sum += part * points.weights[i] *
                       (are_layers ? field_of_loop(corners, p) : pull_of_triangle(corners, p));
                for (const Vec3& corner : corners) nearest = std::min(nearest, (p - corner).norm());
            }
        }
        return sum;
    };
    // The force on a source by another, of another body or of the same. A face comes after all elements.
    struct Push {
        std::array<Index, 2> sources, bodies;
        double nearest;
        Vec3 taken = Vec3::Zero(), finer = Vec3::Zero();
    };
    std::vector<Push> pushes;
    const Index n_elements = static_cast<Index>(elements_.size());
    for (const std::array<Index, 2>& each : near.elements) {
        const Index first = element_order_[each[0]], second = element_order_[each[1]];
        const Element &a = elements_[first], &b = elements_[second];
        const double apart = values_of(at.middle(a) - at.middle(b)).norm(),
                     longer = std::max(a.length, b.length);
        const double distance = values_of(before.middle(a) - before.middle(b)).norm();
        const bool were_near = body_of(a) == body_of(b) && distance < of_elements.far * longer;
        if (!were_near && apart < of_elements.near * longer)
            pushes.push_back({{first, second}, {body_of(a), body_of(b)}, apart});
    }
    for (const std::array<Index, 2>& each : near.sides) {
        const Index e = element_order_[each[0]], f = face_order_[each[1]];
        const Element& element = elements_[e];
        const double apart = values_of(at.middle(element) - at.center(faces_[f])).norm();
        const double distance = values_of(before.middle(element) - before.center(faces_[f])).norm();
        const double longer = std::max(element.length, faces_[f].size);
        const bool were_near = body_of(element) == body_of_face[f] && distance < of_elements.far * longer;
        if (!were_near && apart < longer)
            pushes.push_back({{e, n_elements + f}, {body_of(element), body_of_face[f]}, apart});
    }
    in_blocks(static_cast<Index>(pushes.size()), [&](Index begin, Index end) {
        for (Index k = begin; k < end; ++k) {
            Push& push = pushes[k];
            const auto& [first, second] = push.sources;
            const Element& a = elements_[first];
            if (second >= n_elements) {
                const Index f = second - n_elements;
                const double product = strength * at.charges[first] * at.currents[f];
                push.taken = product * field_of_face(first, f, true, push.nearest);
                push.finer = product * field_of_face(first, f, false, push.nearest);
                continue;
            }
            const Element& b = elements_[second];
            double product = at.charges[first] * at.charges[second];
            if (a.is_edge() && b.is_edge())
                product -=
                    at.element_currents[first] * at.element_currents[second] * dot(at.along(a), at.along(b));
            const Points points[2] = {points_of(first, false), points_of(second, false)};
            push.taken = push.finer = strength * product * sum_of_pulls(points[0], points[1], push.nearest);
            if (push.nearest < enough * std::max(a.length, b.length))
                push.finer = strength * product *
                             (a.length < b.length ? mean_pull(first, second) : -mean_pull(second, first));
        }
    });
    std::vector<Index> counts(n_bodies, 0);
    for (const Element& element : elements_) {
        found.centers[body_of(element)] += values_of(at.middle(element));
        ++counts[body_of(element)];
    }
    for (Index body = 0; body < n_bodies; ++body)
        found.centers[body] /= static_cast<double>(std::max<Index>(counts[body], 1));
    // Where a force acts, from the center of its body: at the middle of an element or at the center of a face.
    const auto arm_of = [&](Index source, Index body) {
        const Vec3 place = source < n_elements ? values_of(at.middle(elements_[source]))
                                               : values_of(at.center(faces_[source - n_elements]));
        return Vec3(place - found.centers[body]);
    };
    std::vector<Vec3> on_sources(elements_.size() + faces_.size(), Vec3::Zero());
    std::vector<Index> bodies(on_sources.size(), 0);
    for (const Push& push : pushes) {
        if (push.bodies[0] == push.bodies[1]) {
            const Index body = push.bodies[0];
            const double size = push.finer.norm();
            found.finer_within[body] += size;
            found.taken_within[body] += size > 0.0 ? push.taken.dot(push.finer) / size : 0.0;
            found.nearest_within[body] = std::min(found.nearest_within[body], push.nearest);
            continue;
        }
        for (int side = 0; side < 2; ++side) {
            const double sign = side == 0 ? 1.0 : -1.0;
            const Index body = push.bodies[side], source = push.sources[side];
            const Vec3 arm = arm_of(source, body);
            found.forces.taken[body] += sign * push.taken;
            found.forces.finer[body] += sign * push.finer;
            found.couples.taken[body] += sign * arm.cross(push.taken);
            found.couples.finer[body] += sign * arm.cross(push.finer);
            found.nearest[body] = std::min(found.nearest[body], push.nearest);
            on_sources[source] += sign * push.finer;
            bodies[source] = body;
        }
    }
    for (std::size_t k = 0; k < on_sources.size(); ++k) {
        if (on_sources[k] == Vec3::Zero()) continue;
        const double size = on_sources[k].norm();
        found.forces.sizes[bodies[k]] += size;
        found.couples.sizes[bodies[k]] += size * arm_of(static_cast<Index>(k), bodies[k]).norm();
    }
    return found;
}

}  // namespace magshell
