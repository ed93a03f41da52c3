#include "magshell/contact/contact_surface.h"

#include <algorithm>

namespace magshell {
namespace {

/// Lists each distinct part among (nodes, face) once, with the first of its faces and the sum of its areas.
template <class Part>
void gather(std::vector<std::pair<Part, Index>> all, const std::vector<double>& thirds,
            std::vector<Part>& parts, std::vector<Index>& faces, std::vector<double>& areas) {
    std::sort(all.begin(), all.end());
    for (const auto& [part, face] : all) {
        if (parts.empty() || parts.back() != part) {
            parts.push_back(part);
            faces.push_back(face);
            areas.push_back(0.0);
        }
        areas.back() += thirds[face];
    }
}

}  // namespace

ContactSurface::ContactSurface(std::vector<Face> given, const std::vector<Vec3>& rest)
    : faces(std::move(given)) {
    std::vector<std::pair<Index, Index>> corners;
    std::vector<std::pair<Edge, Index>> sides;
    std::vector<double> thirds;
    for (Index f = 0; f < n_faces(); ++f) {
        const Face& face = faces[f];
        const Vec3 &a = rest[face[0]], &b = rest[face[1]], &c = rest[face[2]];
        thirds.push_back((b - a).cross(c - a).norm() / 6.0);
        for (int k = 0; k < 3; ++k) {
            corners.push_back({face[k], f});
            const auto [low, high] = std::minmax(face[k], face[(k + 1) % 3]);
            sides.push_back({{low, high}, f});
        }
    }
    gather(std::move(corners), thirds, vertices, vertex_faces, vertex_areas);
    gather(std::move(sides), thirds, edges, edge_faces, edge_areas);
    brought.resize(faces.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        Brought& by = brought[vertex_faces[v]];
        by.vertices[by.n_vertices++] = static_cast<Index>(v);
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
        Brought& by = brought[edge_faces[e]];
        by.edges[by.n_edges++] = static_cast<Index>(e);
        edge_lengths.push_back((rest[edges[e][1]] - rest[edges[e][0]]).norm());
    }
}

}  // namespace magshell
