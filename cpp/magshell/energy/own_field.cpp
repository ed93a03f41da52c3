#include "magshell/energy/own_field.h"

#include <algorithm>
#include <cmath>

#include "magshell/core/errors.h"
#include "magshell/mesh/half_edges.h"

namespace magshell {
namespace {

// Writes the numbers for which `first` holds before the others into `order` and returns how many they are.
template <class First>
Index partition_numbers(Index count, std::vector<Index>& order, const First& first) {
    order.clear();
    for (Index k = 0; k < count; ++k)
        if (first(k)) order.push_back(k);
    const Index found = static_cast<Index>(order.size());
    for (Index k = 0; k < count; ++k)
        if (!first(k)) order.push_back(k);
    return found;
}

// Numbers the entries that are marked one after another; the others have -1.
std::vector<Index> numbered(const std::vector<bool>& marked) {
    std::vector<Index> numbers(marked.size(), -1);
    Index next = 0;
    for (std::size_t k = 0; k < marked.size(); ++k)
        if (marked[k]) numbers[k] = next++;
    return numbers;
}

// Returns the entries that are marked.
template <class Entries>
Entries selected(const Entries& entries, const std::vector<bool>& marked) {
    Entries some;
    for (std::size_t k = 0; k < marked.size(); ++k)
        if (marked[k]) some.push_back(entries[k]);
    return some;
}

}  // namespace

OwnField::OwnField(Faces faces) {
    const Index n = static_cast<Index>(faces.nodes.size());
    for (const std::array<Index, 3>& corners : faces.nodes)
        nodes_.insert(nodes_.end(), corners.begin(), corners.end());
    std::sort(nodes_.begin(), nodes_.end());
    nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
    Rows3i corners(n, 3);
    faces_.resize(n);
    for (Index f = 0; f < n; ++f) {
        Face& face = faces_[f];
        const std::array<Vec3, 3>& x = faces.rest[f];
        const Vec3 across = (x[1] - x[0]).cross(x[2] - x[0]);
        face.area = 0.5 * across.norm();
        face.normal = across.normalized();
        for (int i = 0; i < 3; ++i) {
            corners(f, i) = face.nodes[i] = static_cast<Index>(
                std::lower_bound(nodes_.begin(), nodes_.end(), faces.nodes[f][i]) - nodes_.begin());
            const Vec3 along = x[(i + 2) % 3] - x[(i + 1) % 3];
            face.conormals[i] = along.cross(face.normal);
            face.size = std::max(face.size, along.norm());
        }
        face.rotates = faces.rotates[f];
        face.basis = {(x[1] - x[0]).normalized(), face.normal.cross((x[1] - x[0]).normalized())};
        const double first[2] = {(x[1] - x[0]).dot(face.basis[0]), 0.0};
        const double second[2] = {(x[2] - x[0]).dot(face.basis[0]), (x[2] - x[0]).dot(face.basis[1])};
        face.inverse = {1.0 / first[0], -second[0] / (first[0] * second[1]), 0.0, 1.0 / second[1]};
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 2; ++c) face.in_plane[i][c] = face.conormals[i].dot(face.basis[c]);
    }
    for (const HalfEdge& half : sorted_half_edges(corners, static_cast<Index>(nodes_.size()))) {
        const std::array<Index, 2> ends{half.low, half.high};
        if (edges_.empty() || edges_.back().nodes != ends) {
            const double length = faces_[half.face].conormals[half.corner].norm();
            edges_.push_back({ends, {half.face, -1}, {half.forward ? 1.0 : -1.0, 0.0}, {1.0, 0.0}, length});
        } else {
            Edge& edge = edges_.back();
            if (edge.faces[1] >= 0)
                throw InvalidInput(
                    "own_field: three magnetized faces meet at one edge, as where shells are tied; exclude "
                    "one "
                    "of the shells: ms.OwnField(bodies=...)");
            edge.faces[1] = half.face;
            edge.turns[1] = half.forward ? 1.0 : -1.0;
            edge.normals[1] = edge.turns[0] * edge.turns[1] < 0.0 ? 1.0 : -1.0;
        }
        faces_[half.face].edges[half.corner] = static_cast<Index>(edges_.size()) - 1;
    }
}

void OwnField::set(const std::vector<Vec3>& magnetization, const std::vector<double>& thickness) {
    // [-] Charges and normal components below this part of the largest one are round-off; see
    // test_uniform_tangential_magnetization_has_sources_on_the_border_only.
    constexpr double round_off = 1e-12;
    magnetization_ = magnetization;
    thickness_ = thickness;
    const Index n_faces = static_cast<Index>(faces_.size()), n_edges = static_cast<Index>(edges_.size());
    rest_currents_.assign(n_faces, 0.0);
    side_charges_.assign(n_faces, 0.0);
    edge_charges_.assign(n_edges, 0.0);
    has_charge_.assign(n_edges, false);
    edge_thickness_.assign(n_edges, 0.0);
    std::vector<double> largest(n_edges, 0.0);
    for (Index f = 0; f < n_faces; ++f) {
        const Face& face = faces_[f];
        const Vec3& m = magnetization[f];
        const double along = m.dot(face.normal);
        if (std::abs(along) > round_off * m.norm()) {
            rest_currents_[f] = thickness[f] * along;
            side_charges_[f] = face.area * along;
        }
        for (int i = 0; i < 3; ++i) {
            const double tangential = (m - along * face.normal).norm();
            if (face.rotates && tangential > round_off * m.norm()) has_charge_[face.edges[i]] = true;
            if (face.rotates) continue;
            edge_charges_[face.edges[i]] += thickness[f] * m.dot(face.conormals[i]);
            largest[face.edges[i]] =
                std::max(largest[face.edges[i]], thickness[f] * m.norm() * face.conormals[i].norm());
        }
    }
    has_charges_ = false;
    for (Index e = 0; e < n_edges; ++e) {
        const std::array<Index, 2>& at = edges_[e].faces;
        edge_thickness_[e] = at[1] < 0 ? thickness[at[0]] : 0.5 * (thickness[at[0]] + thickness[at[1]]);
        if (std::abs(edge_charges_[e]) <= round_off * largest[e]) edge_charges_[e] = 0.0;
        if (edge_charges_[e] != 0.0) has_charge_[e] = true;
        has_charges_ |= has_charge_[e];
    }
    active_faces_ = partition_numbers(n_faces, face_order_, [&](Index f) { return side_charges_[f] != 0.0; });
    active_edges_ = partition_numbers(n_edges, edge_order_, [&](Index e) {
        const std::array<Index, 2>& at = edges_[e].faces;
        return has_charge_[e] || side_charges_[at[0]] != 0.0 || (at[1] >= 0 && side_charges_[at[1]] != 0.0);
    });
}

OwnField OwnField::of_sources() const {
    std::vector<bool> edges(edges_.size(), false), faces(faces_.size(), false), nodes(nodes_.size(), false);
    for (Index k = 0; k < active_edges_; ++k) {
        edges[edge_order_[k]] = true;
        for (const Index f : edges_[edge_order_[k]].faces)
            if (f >= 0) faces[f] = true;
    }
    for (std::size_t f = 0; f < faces_.size(); ++f)
        if (faces[f])
            for (const Index node : faces_[f].nodes) nodes[node] = true;
    const std::vector<Index> edge_numbers = numbered(edges), face_numbers = numbered(faces),
                             node_numbers = numbered(nodes);
    OwnField part;
    part.nodes_ = selected(nodes_, nodes);
    part.edges_ = selected(edges_, edges);
    for (Edge& edge : part.edges_) {
        for (Index& node : edge.nodes) node = node_numbers[node];
        for (Index& f : edge.faces) f = f < 0 ? f : face_numbers[f];
    }
    part.faces_ = selected(faces_, faces);
    for (Face& face : part.faces_) {
        for (Index& node : face.nodes) node = node_numbers[node];
        for (Index& edge : face.edges) edge = edge_numbers[edge];
    }
    for (Index k = 0; k < active_edges_; ++k) part.edge_order_.push_back(edge_numbers[edge_order_[k]]);
    for (Index k = 0; k < active_faces_; ++k) part.face_order_.push_back(face_numbers[face_order_[k]]);
    part.active_edges_ = active_edges_;
    part.active_faces_ = active_faces_;
    part.edge_charges_ = selected(edge_charges_, edges);
    part.has_charge_ = selected(has_charge_, edges);
    part.edge_thickness_ = selected(edge_thickness_, edges);
    part.thickness_ = selected(thickness_, faces);
    part.rest_currents_ = selected(rest_currents_, faces);
    part.magnetization_ = selected(magnetization_, faces);
    part.side_charges_ = selected(side_charges_, faces);
    part.has_charges_ = has_charges_;
    part.accuracy_ = accuracy_;
    return part;
}

std::size_t OwnField::bytes() const {
    return nodes_.size() * sizeof(Index) + edges_.size() * (sizeof(Edge) + 2 * sizeof(double)) +
           faces_.size() * (sizeof(Face) + sizeof(Vec3) + 3 * sizeof(double));
}

}  // namespace magshell
