// Triangles that may touch others, with what contact needs to know of their vertices and edges.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

struct ContactSurface {
    using Face = std::array<Index, 3>;
    using Edge = std::array<Index, 2>;

    /// faces: three nodes each, of all there are; rest: where nodes are at rest [m]. Areas of vertices and edges are
    /// thirds of those of the faces around.
    ContactSurface(std::vector<Face> faces, const std::vector<Vec3>& rest);

    Index n_faces() const { return static_cast<Index>(faces.size()); }

    std::vector<Face> faces;
    std::vector<Index> vertices;  // nodes, sorted, each once
    std::vector<double> vertex_areas;
    std::vector<Index> vertex_faces;  // one face of each: it brings its vertex where it goes
    std::vector<Edge> edges;          // lower node first, sorted, each once
    std::vector<double> edge_areas, edge_lengths;
    std::vector<Index> edge_faces;

    /// The vertices and edges that a face brings, of those numbered above.
    struct Brought {
        std::array<Index, 3> vertices, edges;
        int n_vertices = 0, n_edges = 0;
    };
    std::vector<Brought> brought;
};

}  // namespace magshell
