#include <algorithm>
#include <cmath>
#include <numbers>

#include "magshell/core/parallel.h"
#include "magshell/energy/own_field.h"
#include "magshell/energy/own_field_pairs.h"
#include "magshell/field/dipoles.h"

namespace magshell {
namespace {

constexpr double strength = vacuum_permeability / (4.0 * std::numbers::pi);  // mu_0/(4 pi)
constexpr int block = 16;  // targets that a thread takes at once

struct GaussRule {
    int count;
    const double *points, *weights;  // on [0, 1]
};
constexpr double points_2[] = {0.21132486540518712, 0.78867513459481288}, weights_2[] = {0.5, 0.5},
                 points_4[] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                               0.93056815579702629},
                 weights_4[] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                0.17392742256872693};
constexpr GaussRule coarse{2, points_2, weights_2}, fine{4, points_4, weights_4};

// Barycentric coordinates of the three points of a face, of equal weights; exact for quadratic functions.
constexpr double face_points[3][3] = {
    {2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0}, {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0}, {1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0}};

// Distances of midpoints over the length of the longer edge, or the size of the face, up to which a pair is near, and from which on it
// is far [-]; see test_force_between_plates_equals_the_closed_form.
struct Blend {
    double near, far;
};
constexpr Blend of_edges{1.5, 2.0}, of_sides{2.5, 3.5};

// The weight of the near value and its derivatives by t: 1 below near, 0 above far, with continuous second derivatives.
struct BlendWeight {
    double value, slope, curvature;
};
BlendWeight blend(const Blend& range, double t) {
    if (t <= range.near) return {1.0, 0.0, 0.0};
    if (t >= range.far) return {0.0, 0.0, 0.0};
    const double width = range.far - range.near, s = (range.far - t) / width;
    return {s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), -30.0 * s * s * (1.0 - s) * (1.0 - s) / width,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (width * width)};
}

// Converts the weight and its slope to the type of t: a double, or a dual number.
void lift(const BlendWeight& weight, double, double& value, double& slope) {
    value = weight.value;
    slope = weight.slope;
}
void lift(const BlendWeight& weight, const Dual& t, Dual& value, Dual& slope) {
    value = {weight.value, weight.slope * t.rate};
    slope = {weight.slope, weight.curvature * t.rate};
}

// The solid angle of the triangle with corners r, seen from the origin, positive on the side of its normal [Van Oosterom, Strackee 1983], and its
// derivatives by the corners.
template <class T>
T solid_angle(const Triple<T> r[3], Triple<T> by_corner[3]) {
    using std::atan2;
    const T l[3] = {norm(r[0]), norm(r[1]), norm(r[2])};
    const Triple<T> across[3] = {cross(r[1], r[2]), cross(r[2], r[0]), cross(r[0], r[1])};
    const T d[3] = {dot(r[1], r[2]), dot(r[2], r[0]), dot(r[0], r[1])};
    const T volume = dot(r[0], across[0]);
    const T other = l[0] * l[1] * l[2] + d[0] * l[0] + d[1] * l[1] + d[2] * l[2];
    const T scale = T(2.0) / (volume * volume + other * other);
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const Triple<T> by_other = ((l[i] * l[j] + d[k]) / l[k]) * r[k] + l[j] * r[i] + l[i] * r[j];
        by_corner[k] = scale * (volume * by_other - other * across[k]);
    }
    return T(-2.0) * atan2(volume, other);
}

// Runs body(first, last) over ranges of targets on all threads.
template <class Body>
void in_blocks(Index count, const Body& body) {
    parallel_for((count + block - 1) / block,
                 [&](int part) { body(part * block, std::min<Index>(count, (part + 1) * block)); });
}

}  // namespace

/// The deformed sheets: what the sources depend on.
template <class T>
struct OwnField::Geometry {
    const OwnField& field;
    const std::vector<Triple<T>>& x;
    std::vector<Triple<T>> normals, edge_normals;  // of faces, of edges
    std::vector<T> areas, currents, edge_currents;

    Geometry(const OwnField& f, const std::vector<Triple<T>>& positions) : field(f), x(positions) {
        normals.resize(f.faces_.size());
        areas.resize(f.faces_.size());
        currents.resize(f.faces_.size());
        edge_normals.resize(f.edges_.size());
        edge_currents.resize(f.edges_.size());
        for (std::size_t k = 0; k < f.faces_.size(); ++k) {
            const Face& face = f.faces_[k];
            const Triple<T>& origin = x[face.nodes[0]];
            const Triple<T> across = cross(x[face.nodes[1]] - origin, x[face.nodes[2]] - origin);
            const T length = norm(across);
            normals[k] = (T(1.0) / length) * across;
            areas[k] = T(0.5) * length;
            currents[k] = T(f.rest_currents_[k] * face.area) / areas[k];
        }
        for (std::size_t k = 0; k < f.edges_.size(); ++k) {
            const Edge& edge = f.edges_[k];
            edge_normals[k] = normals[edge.faces[0]];
            edge_currents[k] = T(edge.turns[0]) * currents[edge.faces[0]];
            if (edge.faces[1] < 0) continue;
            const Triple<T> sum = edge_normals[k] + T(edge.normals[1]) * normals[edge.faces[1]];
            edge_normals[k] = (T(1.0) / norm(sum)) * sum;
            edge_currents[k] += T(edge.turns[1]) * currents[edge.faces[1]];
        }
    }

    Triple<T> along(const Edge& edge) const { return x[edge.nodes[1]] - x[edge.nodes[0]]; }
    Triple<T> middle(const Edge& edge) const { return T(0.5) * (x[edge.nodes[0]] + x[edge.nodes[1]]); }
    Triple<T> center(const Face& face) const {
        return T(1.0 / 3.0) * (x[face.nodes[0]] + x[face.nodes[1]] + x[face.nodes[2]]);
    }

    // Calls body(point, s, zeta, weight) for the Gauss points of an edge; zeta over the thickness.
    template <class Body>
    void each_point(Index e, const GaussRule& rule, const Body& body) const {
        const Edge& edge = field.edges_[e];
        const Triple<T> line = along(edge);
        for (int i = 0; i < rule.count; ++i)
            for (int j = 0; j < rule.count; ++j) {
                const double s = rule.points[i], zeta = rule.points[j] - 0.5,
                             weight = rule.weights[i] * rule.weights[j];
                SourcePoint<T> point;
                point.at =
                    x[edge.nodes[0]] + T(s) * line + T(zeta * field.edge_thickness_[e]) * edge_normals[e];
                point.charge = weight * field.edge_charges_[e];
                point.current = (T(weight) * edge_currents[e]) * line;
                body(point, s, zeta, weight);
            }
    }

    // Calls body(point, barycentric, zeta, weight) for the points of the charged sides of a face.
    template <class Body>
    void each_side_point(Index f, const Body& body) const {
        const Face& face = field.faces_[f];
        for (const double side : {0.5, -0.5})
            for (const double* weights : face_points) {
                SourcePoint<T> point;
                point.at = T(side * field.thickness_[f]) * normals[f];
                for (int k = 0; k < 3; ++k) point.at += T(weights[k]) * x[face.nodes[k]];
                const double weight = side * 2.0 / 3.0;
                point.charge = weight * field.side_charges_[f];
                body(point, weights, side, weight);
            }
    }

    // Adds the derivatives of the sums at a Gauss point of an edge by the values of that edge.
    void add(Index e, const SourceSums<T>& sums, double s, double zeta, double weight,
             EdgeAdjoint<T>& out) const {
        const Triple<T> pull = T(-strength) * sums.pull;
        const Triple<T> by_element = T(-strength * weight) * sums.currents;
        out.a += T(1.0 - s) * pull - edge_currents[e] * by_element;
        out.b += T(s) * pull + edge_currents[e] * by_element;
        out.normal += T(zeta * field.edge_thickness_[e]) * pull;
        out.thickness += T(zeta) * dot(edge_normals[e], pull);
        out.charge += T(strength * weight) * sums.charges;
        out.current += dot(by_element, along(field.edges_[e]));
    }

    // Does the same at a point of a charged side.
    void add(Index f, const SourceSums<T>& sums, const double* weights, double zeta, double weight,
             FaceAdjoint<T>& out) const {
        const Triple<T> pull = T(-strength) * sums.pull;
        for (int k = 0; k < 3; ++k) out.corners[k] += T(weights[k]) * pull;
        out.normal += T(zeta * field.thickness_[f]) * pull;
        out.thickness += T(zeta) * dot(normals[f], pull);
        out.charge += T(strength * weight) * sums.charges;
    }
};

template <class T>
OwnField::EdgeAdjoint<T>& OwnField::EdgeAdjoint<T>::operator+=(const EdgeAdjoint& other) {
    a += other.a, b += other.b, normal += other.normal;
    charge += other.charge, current += other.current, thickness += other.thickness;
    return *this;
}

template <class T>
OwnField::EdgeAdjoint<T>& OwnField::EdgeAdjoint<T>::operator-=(const EdgeAdjoint& other) {
    a -= other.a, b -= other.b, normal -= other.normal;
    charge -= other.charge, current -= other.current, thickness -= other.thickness;
    return *this;
}

template <class T>
void OwnField::EdgeAdjoint<T>::scale(const T& factor) {
    a = factor * a, b = factor * b, normal = factor * normal;
    charge = factor * charge, current = factor * current, thickness = factor * thickness;
}

template <class T>
OwnField::FaceAdjoint<T>& OwnField::FaceAdjoint<T>::operator+=(const FaceAdjoint& other) {
    for (int k = 0; k < 3; ++k) corners[k] += other.corners[k];
    normal += other.normal;
    current += other.current, charge += other.charge, thickness += other.thickness;
    return *this;
}

template <class T>
void OwnField::FaceAdjoint<T>::scale(const T& factor) {
    for (Triple<T>& corner : corners) corner = factor * corner;
    normal = factor * normal;
    current = factor * current, charge = factor * charge, thickness = factor * thickness;
}

OwnField::Neighbours OwnField::neighbours(const double* q, Targets targets) const {
    const Index n_edges = target_edges(targets), n_faces = target_faces(targets);
    Neighbours near;
    const auto place = [&](Index node) { return Vec3(Eigen::Map<const Vec3>(q + 3 * nodes_[node])); };
    std::vector<Vec3> middles(edges_.size()), centers(faces_.size());
    for (std::size_t e = 0; e < edges_.size(); ++e)
        middles[e] = 0.5 * (place(edges_[e].nodes[0]) + place(edges_[e].nodes[1]));
    for (std::size_t f = 0; f < faces_.size(); ++f)
        centers[f] =
            (place(faces_[f].nodes[0]) + place(faces_[f].nodes[1]) + place(faces_[f].nodes[2])) / 3.0;
    near.edges.resize(n_edges);
    std::vector<std::vector<Index>> near_faces(n_edges);
    in_blocks(n_edges, [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index e = edge_order_[k];
            for (Index j = 0; j < active_edges_; ++j) {
                const Index other = edge_order_[j];
                const double reach = of_edges.far * std::max(edges_[e].length, edges_[other].length);
                if (other != e && (middles[e] - middles[other]).squaredNorm() < reach * reach)
                    near.edges[k].push_back(j);
            }
            if (!has_sides(targets) || (targets == Targets::sources && edge_charges_[e] == 0.0)) continue;
            for (Index j = 0; j < n_faces; ++j) {
                const Index f = face_order_[j];
                const double reach = of_sides.far * std::max(edges_[e].length, faces_[f].size);
                if ((middles[e] - centers[f]).squaredNorm() < reach * reach) near_faces[k].push_back(j);
            }
        }
    });
    for (Index k = 0; k < n_edges; ++k)
        for (const Index j : near_faces[k]) near.sides.push_back({k, j});
    return near;
}

template <class T>
std::vector<Triple<T>> OwnField::positions(const double* q, const double* rate) const {
    std::vector<Triple<T>> x(nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const double* at = q + 3 * nodes_[k];
        if constexpr (std::is_same_v<T, Dual>) {
            const double* moves = rate + 3 * nodes_[k];
            x[k] = {{at[0], moves[0]}, {at[1], moves[1]}, {at[2], moves[2]}};
        } else {
            x[k] = {at[0], at[1], at[2]};
        }
    }
    return x;
}

template <class T>
void OwnField::add_edge_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                              Evaluation<T>& out) const {
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    const std::size_t few = 4, many = 16;
    SourceArrays coarse_points, fine_points;
    const bool has_currents = active_faces_ > 0;
    coarse_points.resize(few * active_edges_, has_currents, has_rates);
    fine_points.resize(many * active_edges_, has_currents, has_rates);
    in_blocks(active_edges_, [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            std::size_t coarse_k = few * k, fine_k = many * k;
            at.each_point(edge_order_[k], coarse, [&](const SourcePoint<T>& point, double, double, double) {
                coarse_points.set(coarse_k++, point);
            });
            at.each_point(edge_order_[k], fine, [&](const SourcePoint<T>& point, double, double, double) {
                fine_points.set(fine_k++, point);
            });
        }
    });
    in_blocks(target_edges(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index e = edge_order_[k];
            EdgeAdjoint<T>& adjoint = out.edges[e];
            const std::size_t own = k < active_edges_ ? few * k : few * active_edges_, own_end = own + few;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                SourceSums<T> sums;
                coarse_points.add_sums(point, 0, few * active_edges_, own, own_end, sums);
                at.add(e, sums, s, zeta, weight, adjoint);
            });
            for (const Index j : near.edges[k]) {
                const Edge &edge = edges_[e], &other = edges_[edge_order_[j]];
                EdgeAdjoint<T> change;
                at.each_point(e, fine,
                              [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                                  SourceSums<T> sums;
                                  fine_points.add_sums(point, many * j, many * (j + 1), 0, 0, sums);
                                  at.add(e, sums, s, zeta, weight, change);
                              });
                EdgeAdjoint<T> before;
                at.each_point(e, coarse,
                              [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                                  SourceSums<T> sums;
                                  coarse_points.add_sums(point, few * j, few * (j + 1), 0, 0, sums);
                                  at.add(e, sums, s, zeta, weight, before);
                              });
                change -= before;
                const Triple<T> apart = at.middle(edge) - at.middle(other);
                const T distance = norm(apart), longer = std::max(edge.length, other.length);
                T weight, slope;
                lift(blend(of_edges, value_of(distance) / value_of(longer)), distance / longer, weight,
                     slope);
                const T pair_energy =
                    T(edge_charges_[e]) * change.charge + at.edge_currents[e] * change.current;
                const Triple<T> by_middle = (pair_energy * slope / (distance * longer)) * apart;
                change.scale(weight);
                change.a += T(0.5) * by_middle;
                change.b += T(0.5) * by_middle;
                adjoint += change;
            }
        }
    });
    for (Index k = 0; k < active_edges_; ++k) {
        const Index e = edge_order_[k];
        out.energy +=
            T(0.5) * (T(edge_charges_[e]) * out.edges[e].charge + at.edge_currents[e] * out.edges[e].current);
    }
}

template <class T>
void OwnField::add_sides(const Geometry<T>& at, const Neighbours& near, Targets targets,
                         Evaluation<T>& out) const {
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    SourceArrays edge_points, side_points;
    edge_points.resize(4 * static_cast<std::size_t>(active_edges_), false, has_rates);
    side_points.resize(6 * static_cast<std::size_t>(active_faces_), false, has_rates);
    for (Index k = 0; k < active_edges_; ++k) {
        std::size_t number = 4 * static_cast<std::size_t>(k);
        at.each_point(edge_order_[k], coarse, [&](const SourcePoint<T>& point, double, double, double) {
            edge_points.set(number++, point);
        });
    }
    for (Index k = 0; k < active_faces_; ++k) {
        std::size_t number = 6 * static_cast<std::size_t>(k);
        at.each_side_point(face_order_[k], [&](const SourcePoint<T>& point, const double*, double, double) {
            side_points.set(number++, point);
        });
    }
    std::vector<T> potentials(target_edges(targets));  // dE/dQ_e of the sides
    in_blocks(target_edges(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index e = edge_order_[k];
            EdgeAdjoint<T> adjoint;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                SourceSums<T> sums;
                side_points.add_sums(point, 0, side_points.size(), 0, 0, sums);
                at.add(e, sums, s, zeta, weight, adjoint);
            });
            potentials[k] = adjoint.charge;
            out.edges[e] += adjoint;
        }
    });
    in_blocks(target_faces(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index f = face_order_[k];
            at.each_side_point(
                f, [&](const SourcePoint<T>& point, const double* weights, double zeta, double weight) {
                    SourceSums<T> sums;
                    edge_points.add_sums(point, 0, edge_points.size(), 0, 0, sums);
                    at.add(f, sums, weights, zeta, weight, out.faces[f]);
                });
        }
    });
    std::vector<EdgeAdjoint<T>> of_edges_near(near.sides.size());
    std::vector<FaceAdjoint<T>> of_faces_near(near.sides.size());
    in_blocks(static_cast<Index>(near.sides.size()), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k)
            add_near_side(at, edge_order_[near.sides[k][0]], face_order_[near.sides[k][1]], of_edges_near[k],
                          of_faces_near[k]);
    });
    for (std::size_t k = 0; k < near.sides.size(); ++k) {
        const Index e = edge_order_[near.sides[k][0]], f = face_order_[near.sides[k][1]];
        potentials[near.sides[k][0]] += of_edges_near[k].charge;
        out.edges[e] += of_edges_near[k];
        out.faces[f] += of_faces_near[k];
    }
    for (Index k = 0; k < active_edges_; ++k) out.energy += T(edge_charges_[edge_order_[k]]) * potentials[k];
}

// Replaces the points of a charged side by two layers of dipoles, with the weight of the near value; takes the pair away if the edge
// belongs to the face.
template <class T>
void OwnField::add_near_side(const Geometry<T>& at, Index e, Index f, EdgeAdjoint<T>& of_edge,
                             FaceAdjoint<T>& of_face) const {
    const Edge& edge = edges_[e];
    const Face& face = faces_[f];
    const double charge = edge_charges_[e];
    EdgeAdjoint<T> edge_change;
    FaceAdjoint<T> face_change;
    // Their energy with the points is subtracted.
    at.each_side_point(
        f, [&](const SourcePoint<T>& side, const double* weights, double side_zeta, double side_weight) {
            SourceSums<T> at_side;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                const Triple<T> d = point.at - side.at;
                const T inverse = T(1.0) / norm(d);
                const T cubed = inverse * inverse * inverse;
                SourceSums<T> at_edge;
                at_edge.charges = T(-side.charge) * inverse;
                at_edge.pull = T(-point.charge * side.charge) * cubed * d;
                at.add(e, at_edge, s, zeta, weight, edge_change);
                at_side.charges -= T(point.charge) * inverse;
                at_side.pull -= at_edge.pull;
            });
            at.add(f, at_side, weights, side_zeta, side_weight, face_change);
        });
    const bool meet = edge.faces[0] == f || edge.faces[1] == f;
    if (!meet)
        for (int level = 0; level < coarse.count; ++level) {
            const double side_zeta = coarse.points[level] - 0.5;
            const Triple<T> shift = T(side_zeta * thickness_[f]) * at.normals[f];
            at.each_point(e, fine, [&](const SourcePoint<T>& point, double s, double zeta, double weight) {
                Triple<T> r[3], by_corner[3];
                for (int k = 0; k < 3; ++k) r[k] = at.x[face.nodes[k]] + shift - point.at;
                const T angle = solid_angle(r, by_corner);
                const double share = strength * weight * coarse.weights[level];
                const T potential = T(share) * at.currents[f] * angle;
                edge_change.charge += potential;
                face_change.current += T(share * charge) * angle;
                const T force = T(share * charge) * at.currents[f];
                Triple<T> sum;
                for (int k = 0; k < 3; ++k) {
                    const Triple<T> pull = force * by_corner[k];
                    face_change.corners[k] += pull;
                    sum += pull;
                }
                face_change.normal += T(side_zeta * thickness_[f]) * sum;
                face_change.thickness += T(side_zeta) * dot(at.normals[f], sum);
                edge_change.a -= T(1.0 - s) * sum;
                edge_change.b -= T(s) * sum;
                edge_change.normal -= T(zeta * edge_thickness_[e]) * sum;
                edge_change.thickness -= T(zeta) * dot(at.edge_normals[e], sum);
            });
        }
    const Triple<T> apart = at.middle(edge) - at.center(face);
    const T distance = norm(apart), longer = std::max(edge.length, face.size);
    T weight, slope;
    lift(meet ? BlendWeight{1.0, 0.0, 0.0} : blend(of_sides, value_of(distance) / value_of(longer)),
         distance / longer, weight, slope);
    const Triple<T> by_middle = (T(charge) * edge_change.charge * slope / (distance * longer)) * apart;
    edge_change.scale(weight);
    face_change.scale(weight);
    edge_change.a += T(0.5) * by_middle;
    edge_change.b += T(0.5) * by_middle;
    for (Triple<T>& corner : face_change.corners) corner -= T(1.0 / 3.0) * by_middle;
    of_edge += edge_change;
    of_face += face_change;
}

// Carries the derivatives by normals and currents on to the positions of the nodes.
template <class T>
void OwnField::collect(const Geometry<T>& at, Evaluation<T>& out) const {
    out.by_position.assign(nodes_.size(), {});
    for (std::size_t e = 0; e < edges_.size(); ++e) {
        const Edge& edge = edges_[e];
        EdgeAdjoint<T>& adjoint = out.edges[e];
        out.by_position[edge.nodes[0]] += adjoint.a;
        out.by_position[edge.nodes[1]] += adjoint.b;
        Triple<T> by_normal = adjoint.normal;
        if (edge.faces[1] >= 0) {
            const Triple<T>& n = at.edge_normals[e];
            const T length = norm(at.normals[edge.faces[0]] + T(edge.normals[1]) * at.normals[edge.faces[1]]);
            by_normal = (T(1.0) / length) * (by_normal - dot(n, by_normal) * n);
        }
        for (int k = 0; k < 2 && edge.faces[k] >= 0; ++k) {
            out.faces[edge.faces[k]].normal += T(edge.normals[k]) * by_normal;
            out.faces[edge.faces[k]].current += T(edge.turns[k]) * adjoint.current;
        }
    }
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        const Face& face = faces_[f];
        FaceAdjoint<T>& adjoint = out.faces[f];
        const Triple<T>& n = at.normals[f];
        const T by_area = -adjoint.current * at.currents[f] / at.areas[f];
        const Triple<T> by_across =
            (T(0.5) / at.areas[f]) * (adjoint.normal - dot(n, adjoint.normal) * n) + (T(0.5) * by_area) * n;
        const Triple<T> first = at.x[face.nodes[1]] - at.x[face.nodes[0]],
                        second = at.x[face.nodes[2]] - at.x[face.nodes[0]];
        const Triple<T> by_first = cross(second, by_across), by_second = cross(by_across, first);
        out.by_position[face.nodes[0]] += adjoint.corners[0] - by_first - by_second;
        out.by_position[face.nodes[1]] += adjoint.corners[1] + by_first;
        out.by_position[face.nodes[2]] += adjoint.corners[2] + by_second;
    }
}

template <class T>
OwnField::Evaluation<T> OwnField::evaluate(const std::vector<Triple<T>>& x, const Neighbours& near,
                                           Targets targets) const {
    const Geometry<T> at(*this, x);
    Evaluation<T> out;
    out.edges.resize(edges_.size());
    out.faces.resize(faces_.size());
    add_edge_pairs(at, near, targets, out);
    if (has_sides(targets)) add_sides(at, near, targets, out);
    collect(at, out);
    return out;
}

double OwnField::gradient(const double* q, const Neighbours& near, std::vector<Vec3>& by_position) const {
    const Evaluation<double> found = evaluate(positions<double>(q, nullptr), near, Targets::sources);
    by_position.resize(nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) by_position[k] = values_of(found.by_position[k]);
    return found.energy;
}

void OwnField::add_hessian_product(const double* q, const Neighbours& near, const double* p,
                                   double* out) const {
    const Evaluation<Dual> found = evaluate(positions<Dual>(q, p), near, Targets::sources);
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        Eigen::Map<Vec3>(out + 3 * nodes_[k]) += rates_of(found.by_position[k]);
}

OwnField::FaceGradient OwnField::vjp(const double* q, const double* lambda) const {
    const Index n_faces = static_cast<Index>(faces_.size());
    const Evaluation<Dual> found =
        evaluate(positions<Dual>(q, lambda), neighbours(q, Targets::all), Targets::all);
    FaceGradient by{std::vector<Vec3>(faces_.size(), Vec3::Zero()), std::vector<double>(faces_.size(), 0.0)};
    const std::vector<Triple<Dual>> x = positions<Dual>(q, lambda);
    const Geometry<Dual> at(*this, x);
    for (Index f = 0; f < n_faces; ++f) {
        const Face& face = faces_[f];
        const FaceAdjoint<Dual>& adjoint = found.faces[f];
        // I_f = h (M . n) A~/A, side charge A~ (M . n)
        const double by_rest_current = rate_of(adjoint.current * Dual(face.area) / at.areas[f]);
        const double along = magnetization_[f].dot(face.normal);
        by.magnetization[f] +=
            (thickness_[f] * by_rest_current + face.area * rate_of(adjoint.charge)) * face.normal;
        by.thickness[f] += along * by_rest_current + rate_of(adjoint.thickness);
        for (int i = 0; i < 3; ++i) {
            const EdgeAdjoint<Dual>& edge = found.edges[face.edges[i]];
            by.magnetization[f] += thickness_[f] * rate_of(edge.charge) * face.conormals[i];
            by.thickness[f] += magnetization_[f].dot(face.conormals[i]) * rate_of(edge.charge) +
                               (edges_[face.edges[i]].faces[1] < 0 ? 1.0 : 0.5) * rate_of(edge.thickness);
        }
    }
    return by;
}

// B = mu_0/(4 pi) [ sum q r / r^3 + sum c x r / r^3 ],  r = p - p_j
std::vector<Vec3> OwnField::flux_density(const double* q, const std::vector<Vec3>& points) const {
    const std::vector<Triple<double>> x = positions<double>(q, nullptr);
    const Geometry<double> at(*this, x);
    std::vector<SourcePoint<double>> sources;
    for (Index k = 0; k < active_edges_; ++k)
        at.each_point(edge_order_[k], fine, [&](const SourcePoint<double>& point, double, double, double) {
            sources.push_back(point);
        });
    std::vector<Vec3> flux(points.size(), Vec3::Zero());
    in_blocks(static_cast<Index>(points.size()), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            for (const SourcePoint<double>& source : sources) {
                const Vec3 r = points[k] - values_of(source.at);
                const double cubed = 1.0 / (r.squaredNorm() * r.norm());
                flux[k] += cubed * (source.charge * r + values_of(source.current).cross(r));
            }
            flux[k] *= strength;
        }
    });
    return flux;
}

}  // namespace magshell
