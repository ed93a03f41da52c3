// A sheet as the core sees it: a surface with its folds, its edge rotations and who couples whom.
#pragma once

#include <array>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/stencil.h"
#include "magshell/body/surface.h"
#include "magshell/core/large_memory.h"

namespace magshell {

/// An edge whose angle is measured to a direction: on every face of the edge, no edge rotation, full weight.
struct DirectedEdge {
    Index edge, direction;
};

/// A fold angle between a face and another face or a direction. Node order as in strain/dihedral_angle.h.
struct FoldStencil {
    std::array<Index, 4> nodes;
    bool right_is_point;
    double rest_angle;
    struct Side {
        Index face = -1, corner = -1;
    } left, right;  // the faces whose strain this fold enters, and the corner it is opposite to

    /// What share of the turn each of them takes: half of it, the whole where it is measured to a direction.
    double weight() const { return right_is_point ? 0.5 : 1.0; }

    Index first_face() const {
        return left.face < 0 || (right.face >= 0 && right.face < left.face) ? right.face : left.face;
    }
};

/// What edge i of a face contributes to its bending strain: weight (theta - theta~) + sign phi.
struct FaceSide {
    Index fold = -1, rotation = -1;
    float weight = 0.0f;  // 0, 1/2 or 1
    std::int8_t sign = 0;
    bool on_left = true;
};

class Sheet : public Surface, public Body {
  public:
    using Surface::Surface;

    Index n_elements() const override { return n_faces(); }
    std::span<const Index> nodes_of(Index face) const override { return stencils[face].nodes; }
    std::span<const Index> scalars_of(Index face) const override { return stencils[face].rotations; }
    Index n_folds() const override { return static_cast<Index>(folds.size()); }
    Index element_of_fold(Index fold) const override { return folds[fold].first_face(); }

    /// Once all nodes are numbered. `directors` gives every edge that is not directed a rotation of its own
    /// (midedge), numbered on from the scalars that there are.
    void add_folds(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, bool directors,
                   Nodes& nodes);

    /// Puts the middles of edges where their rotations stand among points of all unknowns.
    void place_rotations(std::vector<Vec3>& points, Index first_scalar) const;

    Index n_edges() const { return static_cast<Index>(rotation_of_edge.size()); }
    /// Edge rotations are the scalars from `first_rotation` on.
    Index n_rotations() const { return static_cast<Index>(edge_of_rotation.size()); }

    std::vector<std::array<Index, 3>> edges;  // per face, the caller's edges, opposite the corners
    LargeVector<FoldStencil> folds;
    LargeVector<std::array<FaceSide, 3>> sides;  // per face
    Index first_rotation = 0;
    std::vector<Index> edge_of_rotation;  // scalar, less the first -> caller's edge
    std::vector<Index> rotation_of_edge;  // caller's edge -> scalar, or -1
    LargeVector<Stencil> stencils;        // per face: corners, the nodes beyond its edges, its rotations

  private:
    Index add_fold(const Nodes& at, const std::array<Index, 4>& nodes, bool right_is_point);
    void add_stencils();
};

}  // namespace magshell
