// ContactSurface: the triangles of a surface in contact, with the vertices, edges and areas that contact needs.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

struct ContactSurface {
    using Face = std::array<Index, 3>;
    using Edge = std::array<Index, 2>;

    /// Creates the surface. faces: three nodes each; rest: reference positions of all nodes [m]. The area of a
    /// vertex or an edge is a third of the areas of the adjacent faces.
    ContactSurface(std::vector<Face> faces, const std::vector<Vec3>& rest);

    Index n_faces() const { return static_cast<Index>(faces.size()); }

    std::vector<Face> faces;
    std::vector<Index> vertices;  // nodes, sorted and unique
    std::vector<double> vertex_areas;
    std::vector<Index> vertex_faces;  // the face that each vertex is assigned to
    std::vector<Edge> edges;          // lower node first, sorted and unique
    std::vector<double> edge_areas, edge_lengths;
    std::vector<Index> edge_faces;

    /// The vertices and edges that are assigned to a face, by their numbers above.
    struct Brought {
        std::array<Index, 3> vertices, edges;
        int n_vertices = 0, n_edges = 0;
    };
    std::vector<Brought> brought;
};

}  // namespace magshell
