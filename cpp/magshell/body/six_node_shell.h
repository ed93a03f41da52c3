// A shell of six-node (quadratic) triangles, which may be curved at rest: its dihedral angles at two points per edge, their rotations,
// and the dofs that its faces couple. To loads and contact it is a surface of four flat triangles per face.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/shell.h"

namespace magshell {

/// The mesh of a six-node shell. Rows of `faces`: corners, then the middle nodes of the edges 0-1, 1-2, 2-0.
struct SixNodeInput {
    Rows3 rest_positions;                         // (n, 3) [m]
    std::vector<std::array<Index, 6>> faces;      // rows of rest_positions
    std::shared_ptr<const TriangleMesh> corners;  // the triangle mesh of the corners alone
    std::vector<Index> vertices;                  // the scene vertex of each row
};

/// The dihedral angle along an edge, at both of its Gauss points. Node order as in strain/dihedral_angle_six.h; absent nodes are negative.
struct DihedralSixStencil {
    std::array<Index, 9> nodes;
    bool right_is_face;
    std::array<double, 2> rest_angle;
    DihedralStencil::Side left, right;

    double weight() const { return right_is_face ? 0.5 : 1.0; }
    Index first_face() const {
        return left.face < 0 || (right.face >= 0 && right.face < left.face) ? right.face : left.face;
    }
};

/// The contribution of Gauss point g of edge i to the bending strain of a face: weight (theta - theta~) + sign phi.
struct FaceSideSix {
    Index dihedral = -1;                       // the angle at its point `point(g)`
    std::array<Index, 2> rotation = {-1, -1};  // scalars
    double weight = 0.0, sign = 0.0;
    bool on_left = true;

    /// Returns the angle's Gauss point at the face's own g; on the right face the order is reversed.
    int point(int g) const { return on_left ? g : 1 - g; }
};

class SixNodeShell final : public Body {
  public:
    SixNodeShell(std::string owner, const SixNodeInput& input, NodeNumbering& numbering);
    SixNodeShell(const SixNodeShell&) = delete;
    SixNodeShell& operator=(const SixNodeShell&) = delete;

    Index n_elements() const override { return n_faces(); }
    std::span<const Index> nodes_of(Index face) const override { return stencils[face].nodes; }
    std::span<const Index> scalars_of(Index face) const override { return stencils[face].rotations; }
    Index n_dihedrals() const override { return static_cast<Index>(dihedrals.size()); }
    Index element_of_dihedral(Index dihedral) const override { return dihedrals[dihedral].first_face(); }

    /// Creates the dihedral angles, once all nodes are numbered; as Shell::add_dihedrals.
    void add_dihedrals(const SixNodeInput& input, const std::vector<DirectedEdge>& directed, Nodes& nodes);

    Index n_faces() const { return faces.size(); }
    /// Returns the number of edge rotations of the caller: two per edge, at its Gauss points from the lower to the higher corner.
    Index n_edge_rotations() const { return static_cast<Index>(rotation_of.size()); }
    void set_rotation_points(std::vector<Vec3>& points, Index first_scalar) const;
    double extent() const;
    /// Adds a sixth of the area of each face to each of its nodes, among all dofs [m2].
    void add_areas(VectorXd& metric) const;
    double largest_coordinate(Index face) const;
    double smallest_height(Index face) const;

    struct Stencil {
        std::array<Index, 15> nodes;     // its own six, then three beyond each edge (see add_stencils)
        std::array<Index, 6> rotations;  // of edge i at Gauss point g: 2 i + g
    };

    const std::string owner;
    Renumbering faces;                            // the caller's <-> ours
    std::vector<std::array<Index, 6>> own_nodes;  // per face
    std::vector<std::array<Vec3, 6>> rest;        // per face [m]
    std::vector<DihedralSixStencil> dihedrals;
    std::vector<std::array<FaceSideSix, 3>> sides;  // per face
    std::vector<Stencil> stencils;
    Index first_rotation = 0;
    std::vector<Index> rotation_of;  // the caller's -> scalar, or -1

  private:
    void add_stencils();
};

}  // namespace magshell
