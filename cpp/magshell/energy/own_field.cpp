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

OwnField::OwnField(Faces faces, const Triangles& triangles, const std::vector<RigidNodes>& rigid)
    : n_tetrahedra_(static_cast<Index>(triangles.rotates.size())) {
    const Index n = static_cast<Index>(faces.nodes.size());
    for (const std::array<Index, 3>& corners : faces.nodes)
        nodes_.insert(nodes_.end(), corners.begin(), corners.end());
    for (const std::array<Index, 3>& corners : triangles.nodes)
        nodes_.insert(nodes_.end(), corners.begin(), corners.end());
    for (const RigidNodes& body : rigid)
        nodes_.insert(nodes_.end(), body.nodes.begin(), body.nodes.begin() + 4);
    std::sort(nodes_.begin(), nodes_.end());
    nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
    const auto local = [&](Index node) {
        return static_cast<Index>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
    };
    Rows3i corners(n, 3);
    faces_.resize(n);
    for (Index f = 0; f < n; ++f) {
        Face& face = faces_[f];
        const std::array<Vec3, 3>& x = faces.rest[f];
        const Vec3 across = (x[1] - x[0]).cross(x[2] - x[0]);
        face.area = 0.5 * across.norm();
        face.normal = across.normalized();
        for (int i = 0; i < 3; ++i) {
            corners(f, i) = face.nodes[i] = local(faces.nodes[f][i]);
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
        const std::array<Index, 3> ends{half.low, half.high, -1};
        if (elements_.empty() || elements_.back().nodes != ends) {
            const double length = faces_[half.face].conormals[half.corner].norm();
            elements_.push_back(
                {ends, {half.face, -1}, {half.forward ? 1.0 : -1.0, 0.0}, {1.0, 0.0}, length, Vec3::Zero()});
        } else {
            Element& element = elements_.back();
            if (element.bodies[1] >= 0)
                throw InvalidInput(
                    "own_field: three magnetized faces meet at one edge, as where shells are tied; exclude "
                    "one "
                    "of the shells: ms.OwnField(bodies=...)");
            element.bodies[1] = half.face;
            element.turns[1] = half.forward ? 1.0 : -1.0;
            element.normals[1] = element.turns[0] * element.turns[1] < 0.0 ? 1.0 : -1.0;
        }
        faces_[half.face].edges[half.corner] = static_cast<Index>(elements_.size()) - 1;
    }
    for (std::size_t t = 0; t < triangles.nodes.size(); ++t) {
        const std::array<Vec3, 3>& x = triangles.rest[t];
        Element& element = elements_.emplace_back();
        for (int i = 0; i < 3; ++i) {
            element.nodes[i] = local(triangles.nodes[t][i]);
            element.length = std::max(element.length, (x[(i + 1) % 3] - x[i]).norm());
        }
        element.bodies = triangles.tetrahedra[t];
        element.turns = {1.0, -1.0};
        element.area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
    }
    collect_rotating(triangles);
    rigid_of_node_.assign(nodes_.size(), -1);
    for (const RigidNodes& body : rigid) {
        Dipole& dipole = dipoles_.emplace_back();
        for (int k = 0; k < 4; ++k) dipole.nodes[k] = local(body.nodes[k]);
        for (const Index node : body.nodes)
            if (const Index k = local(node); k < static_cast<Index>(nodes_.size()) && nodes_[k] == node)
                rigid_of_node_[k] = static_cast<Index>(dipoles_.size()) - 1;
    }
}

void OwnField::collect_rotating(const Triangles& triangles) {
    std::vector<Index> places(triangles.rotates.size(), -1);
    for (Index t = 0; t < n_tetrahedra_; ++t)
        if (triangles.rotates[t]) {
            places[t] = static_cast<Index>(rotating_.size());
            rotating_.push_back({.number = t});
        }
    const Index first = static_cast<Index>(elements_.size() - triangles.nodes.size());
    for (std::size_t k = 0; k < triangles.nodes.size(); ++k) {
        const Index e = first + static_cast<Index>(k);
        const std::array<Vec3, 3>& x = triangles.rest[k];
        for (int side = 0; side < 2; ++side) {
            const Index t = triangles.tetrahedra[k][side];
            if (t < 0 || places[t] < 0) continue;
            Tetrahedron& tetrahedron = rotating_[places[t]];
            tetrahedron.sides.push_back({e, elements_[e].turns[side] * elements_[e].area});
            tetrahedron.volume += tetrahedron.sides.back().area.dot(x[0] + x[1] + x[2]) / 9.0;
        }
    }
}

void OwnField::set(const std::vector<Vec3>& magnetization, const std::vector<double>& thickness,
                   const std::vector<Vec3>& of_tetrahedra) {
    // [-] Charges and normal components below this part of the largest one are round-off; see
    // test_uniform_tangential_magnetization_has_sources_on_the_border_only.
    constexpr double round_off = 1e-12;
    magnetization_ = magnetization;
    thickness_ = thickness;
    const Index n_faces = static_cast<Index>(faces_.size()),
                n_elements = static_cast<Index>(elements_.size());
    rest_currents_.assign(n_faces, 0.0);
    side_charges_.assign(n_faces, 0.0);
    charges_.assign(n_elements, 0.0);
    has_charge_.assign(n_elements, false);
    element_thickness_.assign(n_elements, 0.0);
    std::vector<double> largest(n_elements, 0.0);
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
            charges_[face.edges[i]] += thickness[f] * m.dot(face.conormals[i]);
            largest[face.edges[i]] =
                std::max(largest[face.edges[i]], thickness[f] * m.norm() * face.conormals[i].norm());
        }
    }
    std::vector<bool> rotates(n_tetrahedra_, false);
    for (Tetrahedron& tetrahedron : rotating_) {
        rotates[tetrahedron.number] = true;
        tetrahedron.magnetization = of_tetrahedra[tetrahedron.number];
        for (const Tetrahedron::Side& side : tetrahedron.sides)
            if (tetrahedron.magnetization != Vec3::Zero()) has_charge_[side.element] = true;
    }
    for (Index e = 0; e < n_elements; ++e) {
        const Element& element = elements_[e];
        for (int side = 0; side < 2 && !element.is_edge(); ++side) {
            if (element.bodies[side] < 0 || rotates[element.bodies[side]]) continue;
            const Vec3& m = of_tetrahedra[element.bodies[side]];
            charges_[e] += element.turns[side] * m.dot(element.area);
            largest[e] = std::max(largest[e], m.norm() * element.area.norm());
        }
    }
    has_charges_ = false;
    for (Index e = 0; e < n_elements; ++e) {
        const std::array<Index, 2>& at = elements_[e].bodies;
        if (elements_[e].is_edge())
            element_thickness_[e] =
                at[1] < 0 ? thickness[at[0]] : 0.5 * (thickness[at[0]] + thickness[at[1]]);
        if (std::abs(charges_[e]) <= round_off * largest[e]) charges_[e] = 0.0;
        if (charges_[e] != 0.0) has_charge_[e] = true;
        has_charges_ |= has_charge_[e];
    }
    active_faces_ = partition_numbers(n_faces, face_order_, [&](Index f) { return side_charges_[f] != 0.0; });
    active_elements_ = partition_numbers(n_elements, element_order_, [&](Index e) {
        const std::array<Index, 2>& at = elements_[e].bodies;
        if (has_charge_[e]) return true;
        return elements_[e].is_edge() &&
               (side_charges_[at[0]] != 0.0 || (at[1] >= 0 && side_charges_[at[1]] != 0.0));
    });
}

void OwnField::set(const std::vector<DipoleWeights>& dipoles) {
    for (std::size_t d = 0; d < dipoles_.size(); ++d) dipoles_[d].weights = dipoles[d];
}

OwnField OwnField::of_sources() const {
    std::vector<bool> elements(elements_.size(), false), faces(faces_.size(), false),
        nodes(nodes_.size(), false);
    for (Index k = 0; k < active_elements_; ++k) {
        const Element& element = elements_[element_order_[k]];
        elements[element_order_[k]] = true;
        for (int i = 0; i < element.n_nodes(); ++i) nodes[element.nodes[i]] = true;
        for (const Index f : element.bodies)
            if (f >= 0 && element.is_edge()) faces[f] = true;
    }
    for (std::size_t f = 0; f < faces_.size(); ++f)
        if (faces[f])
            for (const Index node : faces_[f].nodes) nodes[node] = true;
    for (const Dipole& dipole : dipoles_)
        for (const Index node : dipole.nodes) nodes[node] = true;
    const std::vector<Index> element_numbers = numbered(elements), face_numbers = numbered(faces),
                             node_numbers = numbered(nodes);
    OwnField part;
    part.nodes_ = selected(nodes_, nodes);
    part.elements_ = selected(elements_, elements);
    part.n_tetrahedra_ = n_tetrahedra_;
    for (const Tetrahedron& tetrahedron : rotating_)
        if (tetrahedron.magnetization != Vec3::Zero()) {
            part.rotating_.push_back(tetrahedron);
            for (Tetrahedron::Side& side : part.rotating_.back().sides)
                side.element = element_numbers[side.element];
        }
    part.dipoles_ = dipoles_;
    for (Dipole& dipole : part.dipoles_)
        for (Index& node : dipole.nodes) node = node_numbers[node];
    part.rigid_of_node_ = selected(rigid_of_node_, nodes);
    for (Element& element : part.elements_) {
        for (int i = 0; i < element.n_nodes(); ++i) element.nodes[i] = node_numbers[element.nodes[i]];
        for (Index& f : element.bodies)
            if (f >= 0 && element.is_edge()) f = face_numbers[f];
    }
    part.faces_ = selected(faces_, faces);
    for (Face& face : part.faces_) {
        for (Index& node : face.nodes) node = node_numbers[node];
        for (Index& edge : face.edges) edge = element_numbers[edge];
    }
    for (Index k = 0; k < active_elements_; ++k)
        part.element_order_.push_back(element_numbers[element_order_[k]]);
    for (Index k = 0; k < active_faces_; ++k) part.face_order_.push_back(face_numbers[face_order_[k]]);
    part.active_elements_ = active_elements_;
    part.active_faces_ = active_faces_;
    part.charges_ = selected(charges_, elements);
    part.has_charge_ = selected(has_charge_, elements);
    part.element_thickness_ = selected(element_thickness_, elements);
    part.thickness_ = selected(thickness_, faces);
    part.rest_currents_ = selected(rest_currents_, faces);
    part.magnetization_ = selected(magnetization_, faces);
    part.side_charges_ = selected(side_charges_, faces);
    part.has_charges_ = has_charges_;
    part.accuracy_ = accuracy_;
    return part;
}

std::size_t OwnField::bytes() const {
    return nodes_.size() * sizeof(Index) + elements_.size() * (sizeof(Element) + 2 * sizeof(double)) +
           faces_.size() * (sizeof(Face) + sizeof(Vec3) + 3 * sizeof(double)) +
           rotating_.size() * (sizeof(Tetrahedron) + 4 * sizeof(Tetrahedron::Side));
}

}  // namespace magshell
