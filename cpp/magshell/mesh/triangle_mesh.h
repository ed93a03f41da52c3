// TriangleMesh: a triangulated surface: reference positions, faces, and their adjacency at edges.
//
// Faces are counter-clockwise seen from the side that their normal points to. Edge i of a face is opposite its
// vertex i:
//
//   a_i = x_{i+2} - x_{i+1}  (indices mod 3),   a_0 + a_1 + a_2 = 0,   normal ~ a_0 x a_1
//
// Edges run from the lower to the higher vertex and are sorted, so the same triangles give the same edges in
// any order.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

using Rows2i = Eigen::Matrix<Index, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Rows3i = Eigen::Matrix<Index, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Rows3l = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// An oriented manifold surface, with or without boundary, of one or several connected parts. Immutable.
class TriangleMesh {
  public:
    /// The entry of edge_faces() for a missing face at the boundary.
    static constexpr Index none = -1;

    /// Creates the mesh from rest_positions (n_v, 3) [m] and faces (n_f, 3). Throws InvalidInput, naming the
    /// first offender, for coordinates that are not finite, indices out of range, degenerate or duplicate
    /// faces, edges with three faces or with two of opposite orientation, and vertices that no face uses. Faces
    /// are given with 64-bit indices so that an index too large is reported instead of wrapped.
    TriangleMesh(Rows3 rest_positions, const Rows3l& faces);

    Index n_vertices() const { return static_cast<Index>(rest_positions_.rows()); }
    Index n_faces() const { return static_cast<Index>(faces_.rows()); }
    Index n_edges() const { return static_cast<Index>(edges_.rows()); }

    const Rows3& rest_positions() const { return rest_positions_; }  // (n_v, 3), m
    const Rows3i& faces() const { return faces_; }                   // (n_f, 3)
    const Rows2i& edges() const { return edges_; }                   // (n_e, 2), lower vertex first, sorted
    /// Returns (n_e, 2): the face that runs the edge forward (lower to higher vertex), then the one that runs
    /// it backward.
    const Rows2i& edge_faces() const { return edge_faces_; }
    const Rows3i& face_edges() const { return face_edges_; }  // (n_f, 3): the edge opposite each vertex

    bool is_boundary(Index edge) const {
        return edge_faces_(edge, 0) == none || edge_faces_(edge, 1) == none;
    }

  private:
    void check_faces(const Rows3l& faces) const;
    void connect();

    Rows3 rest_positions_;
    Rows3i faces_;
    Rows2i edges_;
    Rows2i edge_faces_;
    Rows3i face_edges_;
};

}  // namespace magshell
