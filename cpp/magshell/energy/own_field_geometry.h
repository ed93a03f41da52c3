// The deformed sheets of an OwnField and their source points (energy/own_field.h), for the files that add up over them.
#pragma once

#include <algorithm>
#include <numbers>

#include "magshell/core/parallel.h"
#include "magshell/energy/face_points.h"
#include "magshell/energy/own_field.h"
#include "magshell/energy/own_field_pairs.h"
#include "magshell/energy/own_field_poses.h"
#include "magshell/energy/source_tree.h"
#include "magshell/energy/unstretched_vector.h"
#include "magshell/field/dipoles.h"

namespace magshell {
namespace own_field {

inline constexpr double strength = vacuum_permeability / (4.0 * std::numbers::pi);  // mu_0/(4 pi)
inline constexpr int block = 16;  // targets that a thread takes at once
inline constexpr Index block_of_pairs =
    128;  // near pairs, so many that lanes are left empty in few of each kind

struct GaussRule {
    int count;
    const double *points, *weights;  // on [0, 1]
};
inline constexpr double points_2[] = {0.21132486540518712, 0.78867513459481288}, weights_2[] = {0.5, 0.5},
                        points_3[] = {0.11270166537925831, 0.5, 0.88729833462074169},
                        weights_3[] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0},
                        points_4[] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                      0.93056815579702629},
                        weights_4[] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                       0.17392742256872693};
inline constexpr GaussRule coarse{2, points_2, weights_2}, medium{3, points_3, weights_3},
    fine{4, points_4, weights_4};

// Barycentric coordinates of the three points of a face, of equal weights; exact for quadratic functions.
inline constexpr double face_points[3][3] = {
    {2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0}, {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0}, {1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0}};

// Four points of a triangle, exact for cubic functions, and seven for functions of fifth degree [Strang, Fix 1973]; near ones have the
// sixteen of energy/face_points.h.
inline constexpr FacePoint triangle_points[4] = {{{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, 0.0, -27.0 / 48.0},
                                                 {{0.6, 0.2, 0.2}, 0.0, 25.0 / 48.0},
                                                 {{0.2, 0.6, 0.2}, 0.0, 25.0 / 48.0},
                                                 {{0.2, 0.2, 0.6}, 0.0, 25.0 / 48.0}};

inline constexpr FacePoint medium_triangle_points[7] = {
    {{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, 0.0, 9.0 / 40.0},
    {{0.059715871789769820, 0.47014206410511509, 0.47014206410511509}, 0.0, 0.13239415278850618},
    {{0.47014206410511509, 0.059715871789769820, 0.47014206410511509}, 0.0, 0.13239415278850618},
    {{0.47014206410511509, 0.47014206410511509, 0.059715871789769820}, 0.0, 0.13239415278850618},
    {{0.79742698535308732, 0.10128650732345634, 0.10128650732345634}, 0.0, 0.12593918054482715},
    {{0.10128650732345634, 0.79742698535308732, 0.10128650732345634}, 0.0, 0.12593918054482715},
    {{0.10128650732345634, 0.10128650732345634, 0.79742698535308732}, 0.0, 0.12593918054482715}};

// The relative distance t of a pair up to which it is near, and from which on it is far [-]; between these its two values
// are blended. t is the distance of the midpoints over the larger size: of two elements, or of an element and the face whose
// sides are meant; a size is the length of an edge, or the longest side of a triangle. See
// test_force_between_plates_equals_the_closed_form.
struct Blend {
    double near, far;
};
inline constexpr Blend of_elements{1.5, 2.0}, of_sides{2.5, 3.5};

// The relative distances of near pairs up to which products that need few digits take the fine points, and from which on they take the
// coarse ones, without blending; between these they take the medium points [-]. See test_rough_products_are_close_to_exact_ones.
inline constexpr Blend of_rough_edges{1.2, 1.7}, of_rough_triangles{1.0, 1.5},
    of_rough_sides{1.2, 2.2};  // plain-words: ok, of products

// Returns the parts of two sizes in the derivative of the larger one: halves where they are the same.
inline std::array<double, 2> parts_of_larger(double first, double second) {
    if (std::abs(first - second) <= 1e-12 * std::max(first, second)) return {0.5, 0.5};
    return first > second ? std::array<double, 2>{1.0, 0.0} : std::array<double, 2>{0.0, 1.0};
}

// Runs body(first, last) over ranges of targets on all threads.
template <class Body>
void in_blocks(Index count, const Body& body) {
    parallel_for((count + block - 1) / block,
                 [&](int part) { body(part * block, std::min<Index>(count, (part + 1) * block)); });
}

// Calls fill(begin, count, entries) for blocks of pairs on all threads, which sets the entries of the pairs from `begin` on, and
// add(k, entry) for every pair in order. Keeps the entries of a chunk of pairs.
template <class Entry, class Fill, class Add>
void fill_in_order(Index n_pairs, const Fill& fill, const Add& add) {
    constexpr Index chunk = 2048;
    std::vector<Entry> entries(static_cast<std::size_t>(std::min(chunk, n_pairs)));
    for (Index begin = 0; begin < n_pairs; begin += chunk) {
        const Index count = std::min(chunk, n_pairs - begin);
        parallel_for((count + block_of_pairs - 1) / block_of_pairs, [&](int part) {
            const Index first = part * block_of_pairs;
            fill(begin + first, std::min(block_of_pairs, count - first), entries.data() + first);
        });
        for (Index k = 0; k < count; ++k) add(begin + k, entries[k]);
    }
}

// Returns the points of a triangle by a rule. The fine ones of energy/face_points.h are listed twice, on two levels through a thickness,
// which a triangle does not have.
inline std::vector<FacePoint> points_of_triangle(const GaussRule& rule) {
    if (&rule == &coarse) return {std::begin(triangle_points), std::end(triangle_points)};
    if (&rule == &medium) return {std::begin(medium_triangle_points), std::end(medium_triangle_points)};
    std::vector<FacePoint> points;
    for (std::size_t k = 0; k < face_points::fine.size(); k += 2) {
        points.push_back(face_points::fine[k]);
        points.back().weight *= 2.0;
    }
    return points;
}

}  // namespace own_field

/// The deformed sheets: what the sources depend on.
template <class T>
struct OwnField::Geometry {
    const OwnField& field;
    const std::vector<Triple<T>>& x;
    std::vector<Triple<T>> normals, element_normals;            // of faces, of elements
    std::vector<T> areas, currents, element_currents, charges;  // charges of elements

    Geometry(const OwnField& f, const std::vector<Triple<T>>& positions) : field(f), x(positions) {
        normals.resize(f.faces_.size());
        areas.resize(f.faces_.size());
        currents.resize(f.faces_.size());
        element_normals.resize(f.elements_.size());
        element_currents.resize(f.elements_.size());
        charges.assign(f.charges_.begin(), f.charges_.end());
        for (std::size_t k = 0; k < f.faces_.size(); ++k) {
            const Face& face = f.faces_[k];
            const Triple<T>& origin = x[face.nodes[0]];
            const Triple<T> across = cross(x[face.nodes[1]] - origin, x[face.nodes[2]] - origin);
            const T length = norm(across);
            normals[k] = (T(1.0) / length) * across;
            areas[k] = T(0.5) * length;
            currents[k] = T(f.rest_currents_[k] * face.area) / areas[k];
            if (!face.rotates) continue;
            const std::array<T, 2> m = unstretched(face)(lifted(f.tangential(k)));
            for (int i = 0; i < 3; ++i)
                if (face.edges[i] >= 0)
                    charges[face.edges[i]] += T(face.in_plane[i][0]) * m[0] + T(face.in_plane[i][1]) * m[1];
        }
        for (const Tetrahedron& tetrahedron : f.rotating_) {
            const Triple<T> m = unstretched(tetrahedron)(lifted(tetrahedron.magnetization));
            for (const Tetrahedron::Side& side : tetrahedron.sides)
                charges[side.element] += dot(lifted(side.area), m);
        }
        for (std::size_t k = 0; k < f.elements_.size(); ++k) {
            const Element& element = f.elements_[k];
            if (!element.is_edge()) continue;
            element_normals[k] = normals[element.bodies[0]];
            element_currents[k] = T(element.turns[0]) * currents[element.bodies[0]];
            if (element.bodies[1] < 0) continue;
            const Triple<T> sum = element_normals[k] + T(element.normals[1]) * normals[element.bodies[1]];
            element_normals[k] = (T(1.0) / norm(sum)) * sum;
            element_currents[k] += T(element.turns[1]) * currents[element.bodies[1]];
        }
    }

    static std::array<T, 2> lifted(const std::array<double, 2>& m) { return {T(m[0]), T(m[1])}; }
    UnstretchedVector<T> unstretched(const Face& face) const {
        const Triple<T>& origin = x[face.nodes[0]];
        return {{x[face.nodes[1]] - origin, x[face.nodes[2]] - origin}, face.inverse};
    }
    static Triple<T> lifted(const Vec3& m) { return {T(m.x()), T(m.y()), T(m.z())}; }
    UnstretchedSolidVector<T> unstretched(const Tetrahedron& tetrahedron) const {
        std::array<Triple<T>, 3> f{};
        for (const Tetrahedron::Side& side : tetrahedron.sides) {
            const Triple<T> center = middle(field.elements_[side.element]);
            for (int c = 0; c < 3; ++c) f[c] += T(side.area[c] / tetrahedron.volume) * center;
        }
        return UnstretchedSolidVector<T>(f);
    }
    // Returns sum a~_t dE/dQ_t over the triangles of a tetrahedron: the gradient with respect to U^-1 M~, in which Q_t is linear.
    Triple<T> by_charges(const Tetrahedron& tetrahedron,
                         const std::vector<ElementAdjoint<T>>& elements) const {
        Triple<T> sum;
        for (const Tetrahedron::Side& side : tetrahedron.sides)
            sum += elements[side.element].charge * lifted(side.area);
        return sum;
    }
    // Returns sum l~_e nu~_e dE/dQ_e over the edges of a face, in the basis of its plane: the gradient with respect to h M~, or by
    // h U^-1 M~ of a face that rotates, in which Q_e is linear. l~_e: length at rest, nu~_e: outward conormal at rest,
    // Q_e: charge of the edge.
    std::array<T, 2> by_charges(const Face& face, const std::vector<ElementAdjoint<T>>& edges) const {
        std::array<T, 2> sum{};
        for (int i = 0; i < 3; ++i)
            if (face.edges[i] >= 0)
                for (int c = 0; c < 2; ++c) sum[c] += T(face.in_plane[i][c]) * edges[face.edges[i]].charge;
        return sum;
    }
    Triple<T> along(const Element& element) const { return x[element.nodes[1]] - x[element.nodes[0]]; }
    Triple<T> middle(const Element& element) const {
        Triple<T> sum = x[element.nodes[0]] + x[element.nodes[1]];
        if (element.is_edge()) return T(0.5) * sum;
        sum += x[element.nodes[2]];
        return T(1.0 / 3.0) * sum;
    }
    // Adds the derivative with respect to middle(element) to those with respect to its nodes.
    void add_by_middle(const Element& element, const Triple<T>& by_middle, ElementAdjoint<T>& out) const {
        const T share = T(element.is_edge() ? 0.5 : 1.0 / 3.0);
        for (int k = 0; k < element.n_nodes(); ++k) out.nodes[k] += share * by_middle;
    }
    Triple<T> position(const Dipole& dipole) const { return sum(dipole, dipole.weights.position); }
    Triple<T> moment(const Dipole& dipole) const { return sum(dipole, dipole.weights.moment); }
    Triple<T> sum(const Dipole& dipole, const std::array<double, 4>& weights) const {
        Triple<T> total;
        for (int k = 0; k < 4; ++k) total += T(weights[k]) * x[dipole.nodes[k]];
        return total;
    }
    Triple<T> center(const Face& face) const {
        return T(1.0 / 3.0) * (x[face.nodes[0]] + x[face.nodes[1]] + x[face.nodes[2]]);
    }

    // Calls body(point, sample) for the Gauss points of an edge or the points of a triangle.
    template <class Body>
    void each_point(Index e, const own_field::GaussRule& rule, const Body& body) const {
        const Element& element = field.elements_[e];
        if (!element.is_edge()) return each_point_of_triangle(e, rule, body);
        const Triple<T> line = along(element);
        for (int i = 0; i < rule.count; ++i)
            for (int j = 0; j < rule.count; ++j) {
                const double s = rule.points[i], zeta = rule.points[j] - 0.5,
                             weight = rule.weights[i] * rule.weights[j];
                SourcePoint<T> point;
                point.at = x[element.nodes[0]] + T(s) * line +
                           T(zeta * field.element_thickness_[e]) * element_normals[e];
                point.charge = T(weight) * charges[e];
                point.current = (T(weight) * element_currents[e]) * line;
                body(point, SamplePoint{{1.0 - s, s, 0.0}, zeta, weight});
            }
    }
    template <class Body>
    void each_point_of_triangle(Index e, const own_field::GaussRule& rule, const Body& body) const {
        const std::array<Index, 3>& nodes = field.elements_[e].nodes;
        const auto add = [&](const FacePoint& given, double weight) {
            const SamplePoint sample{{given.at[0], given.at[1], given.at[2]}, 0.0, weight};
            SourcePoint<T> point;
            for (int k = 0; k < 3; ++k) point.at += T(sample.weights[k]) * x[nodes[k]];
            point.charge = T(weight) * charges[e];
            body(point, sample);
        };
        static const std::vector<FacePoint> few = own_field::points_of_triangle(own_field::coarse),
                                            many = own_field::points_of_triangle(own_field::fine);
        for (const FacePoint& point : &rule == &own_field::coarse ? few : many) add(point, point.weight);
    }

    // Calls body(point, barycentric, zeta, weight) for the three points of each charged side of a face: zeta = 1/2 and
    // weight 1/3 on the side of the normal, zeta = -1/2 and weight -1/3 on the other.
    template <class Body>
    void each_side_point(Index f, const Body& body) const {
        const Face& face = field.faces_[f];
        for (const double side : {0.5, -0.5})
            for (const double* weights : own_field::face_points) {
                SourcePoint<T> point;
                point.at = T(side * field.thickness_[f]) * normals[f];
                for (int k = 0; k < 3; ++k) point.at += T(weights[k]) * x[face.nodes[k]];
                const double weight = side * 2.0 / 3.0;
                point.charge = T(weight * field.side_charges_[f]);
                body(point, weights, side, weight);
            }
    }

    // Adds the derivatives of the energy by the values of an element, given the sums over all sources at one of its points.
    void add(Index e, const SourceSums<T>& sums, const SamplePoint& sample, ElementAdjoint<T>& out) const {
        const Triple<T> pull = T(-own_field::strength) * sums.pull;
        const Element& element = field.elements_[e];
        for (int k = 0; k < element.n_nodes(); ++k) out.nodes[k] += T(sample.weights[k]) * pull;
        out.charge += T(own_field::strength * sample.weight) * sums.charges;
        if (!element.is_edge()) return;
        const Triple<T> by_element = T(-own_field::strength * sample.weight) * sums.currents;
        out.nodes[0] -= element_currents[e] * by_element;
        out.nodes[1] += element_currents[e] * by_element;
        out.normal += T(sample.zeta * field.element_thickness_[e]) * pull;
        out.thickness += T(sample.zeta) * dot(element_normals[e], pull);
        out.current += dot(by_element, along(element));
    }

    own_field::ElementPose<T> pose(Index e) const {
        const Element& element = field.elements_[e];
        own_field::ElementPose<T> pose{middle(element), {along(element), {}}, charges[e], {}, element.length};
        if (element.is_edge()) {
            pose.axes[1] = T(field.element_thickness_[e]) * element_normals[e];
            pose.current = element_currents[e];
        } else {
            pose.axes[1] = x[element.nodes[2]] - x[element.nodes[0]];
        }
        return pose;
    }
    void add(Index e, const own_field::PoseAdjoint<T>& by, ElementAdjoint<T>& out) const {
        const Element& element = field.elements_[e];
        add_by_middle(element, by.middle, out);
        out.nodes[0] -= by.axes[0];
        out.nodes[1] += by.axes[0];
        out.charge += by.charge;
        out.length += by.size;
        if (element.is_edge()) {
            out.current += by.current;
            out.normal += T(field.element_thickness_[e]) * by.axes[1];
            out.thickness += dot(element_normals[e], by.axes[1]);
        } else {
            out.nodes[0] -= by.axes[1];
            out.nodes[2] += by.axes[1];
        }
    }

    own_field::FacePose<T> face_pose(Index f) const {
        const Face& face = field.faces_[f];
        return {{x[face.nodes[0]], x[face.nodes[1]], x[face.nodes[2]]},
                T(field.thickness_[f]) * normals[f],
                currents[f],
                field.side_charges_[f],
                face.size};
    }
    void add(Index f, const own_field::FacePoseAdjoint<T>& by, FaceAdjoint<T>& out) const {
        for (int k = 0; k < 3; ++k) out.corners[k] += by.corners[k];
        out.normal += T(field.thickness_[f]) * by.level;
        out.thickness += dot(normals[f], by.level);
        out.current += by.current;
        out.charge += by.charge;
        out.size += by.size;
    }

    // Adds the derivatives with respect to the values of a face, given the sums at a point of one of its charged sides.
    void add(Index f, const SourceSums<T>& sums, const double* weights, double zeta, double weight,
             FaceAdjoint<T>& out) const {
        const Triple<T> pull = T(-own_field::strength) * sums.pull;
        for (int k = 0; k < 3; ++k) out.corners[k] += T(weights[k]) * pull;
        out.normal += T(zeta * field.thickness_[f]) * pull;
        out.thickness += T(zeta) * dot(normals[f], pull);
        out.charge += T(own_field::strength * weight) * sums.charges;
    }
};

template <class T>
OwnField::ElementAdjoint<T>& OwnField::ElementAdjoint<T>::operator+=(const ElementAdjoint& other) {
    for (int k = 0; k < 3; ++k) nodes[k] += other.nodes[k];
    normal += other.normal;
    charge += other.charge, current += other.current, thickness += other.thickness, length += other.length;
    return *this;
}

/// Trees over the coarse points of the target elements and over the charged sides of the target faces, in the order of `element_order_` and
/// `face_order_`. Elements and faces without a source among them have no strength.
struct OwnField::Trees {
    SourceTree elements, faces;
    BoxPairs element_pairs{}, side_pairs_of_elements{}, side_pairs_of_faces{};
    std::vector<std::size_t> element_positions{}, face_positions{};  // in the order of the tree

    template <class T>
    std::vector<SourcePoint<T>> element_points(const Geometry<T>& at) const {
        std::vector<SourcePoint<T>> points;
        for (const Index k : elements.order())
            at.each_point(at.field.element_order_[k], own_field::coarse,
                          [&](const SourcePoint<T>& point, const SamplePoint&) { points.push_back(point); });
        return points;
    }
    template <class T>
    std::vector<SourcePoint<T>> side_points(const Geometry<T>& at) const {
        std::vector<SourcePoint<T>> points;
        for (const Index k : faces.order())
            at.each_side_point(at.field.face_order_[k], [&](const SourcePoint<T>& point, const double*,
                                                            double, double) { points.push_back(point); });
        return points;
    }
    template <class T>
    std::vector<SourceSums<T>> element_sums(const Geometry<T>& at) const {
        const std::vector<SourcePoint<T>> points = element_points(at);
        return tree_sums(elements, points, elements, points, element_pairs, at.field.active_faces_ > 0, true);
    }
    template <class T>
    std::vector<SourceSums<T>> side_sums_at_elements(const Geometry<T>& at) const {
        return tree_sums(elements, element_points(at), faces, side_points(at), side_pairs_of_elements, false,
                         false);
    }
    template <class T>
    std::vector<SourceSums<T>> element_sums_at_sides(const Geometry<T>& at) const {
        return tree_sums(faces, side_points(at), elements, element_points(at), side_pairs_of_faces, false,
                         false);
    }
};

}  // namespace magshell
