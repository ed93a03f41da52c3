#include "magshell/contact/contact_rest.h"

#include <algorithm>
#include <cmath>

#include "magshell/energy/rest_corners.h"

namespace magshell {
namespace {

// [-] Relative difference below which the areas of two edges count as equal: the derivative of the smaller area by each is then 1/2, the
// mean of both sides. Fixed by test_gradient_by_rest_positions_of_sheets_with_the_same_mesh_agrees_with_differences.
constexpr double same_area = 1e-9;

template <class Part>
std::size_t place_of(const std::vector<Part>& parts, const Part& part) {
    return static_cast<std::size_t>(std::lower_bound(parts.begin(), parts.end(), part) - parts.begin());
}

}  // namespace

ContactRest::ContactRest(const BroadPhase& phase, const std::vector<Vec3>& rest)
    : phase_(phase), rest_(rest), by_nodes_(VectorXd::Zero(3 * static_cast<Index>(rest.size()))) {
    for (const ContactSurface& surface : phase.surfaces()) {
        by_vertex_areas_.emplace_back(surface.vertices.size(), 0.0);
        by_edge_areas_.emplace_back(surface.edges.size(), 0.0);
    }
}

void ContactRest::add(const NearPair& near, const PairEnergy::ByPair& by) {
    if (near.pair.kind == PairKind::edge_edge) {
        add_edges(near, by);
    } else {
        // The area of the pair is proportional to that of its vertex.
        const SurfacePair& contact = phase_.contacts()[near.contact];
        const Index number = near.swapped ? contact.b : contact.a;
        const ContactSurface& surface = phase_.surfaces()[number];
        const std::size_t vertex = place_of(surface.vertices, near.pair.nodes[0]);
        by_vertex_areas_[number][vertex] += by.area * near.pair.area / surface.vertex_areas[vertex];
    }
    if (by.room != 0.0) add_room(near, by.room);
}

void ContactRest::add_edges(const NearPair& near, const PairEnergy::ByPair& by) {
    const SurfacePair& contact = phase_.contacts()[near.contact];
    const Index numbers[2] = {contact.a, contact.b};
    const std::array<Index, 4>& nodes = near.pair.nodes;
    std::size_t edges[2];
    double areas[2];
    for (int side = 0; side < 2; ++side) {
        const ContactSurface& surface = phase_.surfaces()[numbers[side]];
        edges[side] = place_of(surface.edges, ContactSurface::Edge{nodes[2 * side], nodes[2 * side + 1]});
        areas[side] = surface.edge_areas[edges[side]];
    }
    const double smaller = std::min(areas[0], areas[1]);
    const bool same = std::abs(areas[0] - areas[1]) <= same_area * smaller;
    for (int side = 0; side < 2; ++side) {
        if (same || areas[side] == smaller)
            by_edge_areas_[numbers[side]][edges[side]] +=
                (same ? 0.5 : 1.0) * by.area * near.pair.area / areas[side];
        const Vec3 edge = rest_[nodes[2 * side + 1]] - rest_[nodes[2 * side]];  // `parallel` ~ |edge|^2
        const Vec3 by_edge = (2.0 * by.parallel * near.pair.parallel / edge.squaredNorm()) * edge;
        by_nodes_.segment<3>(3 * nodes[2 * side + 1]) += by_edge;
        by_nodes_.segment<3>(3 * nodes[2 * side]) -= by_edge;
    }
}

// The room of a pair (ContactPair::room) is half of its distance at rest; dd/dx_k = w_k n (contact/proximity.h).
void ContactRest::add_room(const NearPair& near, double by_room) {
    PairPositions x;
    const int count = nodes_of(near.pair.kind);
    for (int k = 0; k < count; ++k) x[k] = rest_[near.pair.nodes[k]];
    const Proximity at = proximity(near.pair.kind, x);
    for (int k = 0; k < count; ++k)
        by_nodes_.segment<3>(3 * near.pair.nodes[k]) += 0.5 * by_room * at.weights[k] * at.normal;
}

void ContactRest::add_to(VectorXd& out) const {
    out.head(by_nodes_.size()) += by_nodes_;
    for (std::size_t s = 0; s < phase_.surfaces().size(); ++s) {
        const ContactSurface& surface = phase_.surfaces()[s];
        for (const ContactSurface::Face& face : surface.faces) {
            double by_area = 0.0;  // vertices and edges of a face each have a third of its area
            for (int k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax(face[k], face[(k + 1) % 3]);
                by_area += by_vertex_areas_[s][place_of(surface.vertices, face[k])] +
                           by_edge_areas_[s][place_of(surface.edges, ContactSurface::Edge{low, high})];
            }
            const RestShape shape({rest_[face[0]], rest_[face[1]], rest_[face[2]]});
            for (int k = 0; k < 3; ++k)
                out.segment<3>(3 * face[k]) += by_area / 3.0 * shape.area_by_corner(k);
        }
    }
}

}  // namespace magshell
