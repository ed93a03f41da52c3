// A triangular shell: its surface, dihedral angles, edge rotations, and the dofs that its faces couple.
#pragma once

#include <array>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/stencil.h"
#include "magshell/body/surface.h"
#include "magshell/core/large_memory.h"

namespace magshell {

/// An edge whose angle is measured to a prescribed direction, on every face of the edge. It has no edge rotation, and full weight.
struct DirectedEdge {
    Index edge, direction;
};

/// The dihedral angle between a face and another face or a direction. Node order as in strain/dihedral_angle.h.
struct DihedralStencil {
    std::array<Index, 4> nodes;
    bool right_is_point;
    double rest_angle;
    struct Side {
        Index face = -1, corner = -1;
    } left, right;  // the faces whose bending strain it enters, and the corner opposite to its edge

    /// Returns the fraction of the angle change in the bending strain of each face: half of it, or all if it is measured to a direction.
    double weight() const { return right_is_point ? 0.5 : 1.0; }

    Index first_face() const {
        return left.face < 0 || (right.face >= 0 && right.face < left.face) ? right.face : left.face;
    }
};

/// The contribution of edge i to the bending strain of a face: weight (theta - theta~) + sign phi.
struct FaceSide {
    Index dihedral = -1, rotation = -1;
    float weight = 0.0f;  // 0, 1/2 or 1
    std::int8_t sign = 0;
    bool on_left = true;
};

class Shell : public Surface, public Body {
  public:
    using Surface::Surface;

    Index n_elements() const override { return n_faces(); }
    std::span<const Index> nodes_of(Index face) const override { return stencils[face].nodes; }
    std::span<const Index> scalars_of(Index face) const override { return stencils[face].rotations; }
    Index n_dihedrals() const override { return static_cast<Index>(dihedrals.size()); }
    Index element_of_dihedral(Index dihedral) const override { return dihedrals[dihedral].first_face(); }

    /// Creates the dihedral angles, once all nodes are numbered. directors: gives every edge without direction a rotation of its own
    /// (midedge elements), numbered after the existing scalars.
    void add_dihedrals(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, bool directors,
                       Nodes& nodes);

    /// Sets the points of edge rotations, among points of all dofs, to the middles of their edges.
    void set_rotation_points(std::vector<Vec3>& points, Index first_scalar) const;

    Index n_edges() const { return static_cast<Index>(rotation_of_edge.size()); }
    /// Returns the number of edge rotations, which are the scalars from `first_rotation` on.
    Index n_rotations() const { return static_cast<Index>(edge_of_rotation.size()); }

    std::vector<std::array<Index, 3>> edges;  // per face: the caller's edges, opposite the corners
    LargeVector<DihedralStencil> dihedrals;
    LargeVector<std::array<FaceSide, 3>> sides;  // per face
    Index first_rotation = 0;
    std::vector<Index> edge_of_rotation;  // scalar minus first_rotation -> the caller's edge
    std::vector<Index> rotation_of_edge;  // the caller's edge -> scalar, or -1
    LargeVector<Stencil> stencils;        // per face: corners, the nodes beyond its edges, its rotations

  private:
    Index add_dihedral(const Nodes& at, const std::array<Index, 4>& nodes, bool right_is_point);
    void add_stencils();
};

}  // namespace magshell
