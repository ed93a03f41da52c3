// A sheet of six-node triangles, which may be curved at rest: its folds at two points an edge, their rotations, and who
// couples whom. Towards the outside it is a surface of four flat triangles a face.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/sheet.h"

namespace magshell {

/// Where the core finds one. Rows of `faces`: corners, then the middles of the edges 0-1, 1-2, 2-0.
struct SixNodeInput {
    Rows3 rest_positions;                         // (n, 3) [m]
    std::vector<std::array<Index, 6>> faces;      // rows of it
    std::shared_ptr<const TriangleMesh> corners;  // the faces' corners, renumbered without the middles
    std::vector<Index> vertices;                  // the scene's vertex of each row
};

/// A fold about an edge, at both its Gauss points. Node order as in strain/dihedral_angle_six.h; absent nodes are negative.
struct FoldSixStencil {
    std::array<Index, 9> nodes;
    bool right_is_face;
    std::array<double, 2> rest_angle;
    FoldStencil::Side left, right;

    double weight() const { return right_is_face ? 0.5 : 1.0; }
    Index first_face() const {
        return left.face < 0 || (right.face >= 0 && right.face < left.face) ? right.face : left.face;
    }
};

/// What Gauss point g of edge i contributes to the bending of a face: weight (theta - theta~) + sign phi.
struct FaceSideSix {
    Index fold = -1;                           // the angle of its point `point[g]`
    std::array<Index, 2> rotation = {-1, -1};  // scalars
    double weight = 0.0, sign = 0.0;
    bool on_left = true;

    /// The fold's Gauss point at the face's own g: the other way round on the right.
    int point(int g) const { return on_left ? g : 1 - g; }
};

class SixNodeSheet final : public Body {
  public:
    SixNodeSheet(std::string owner, const SixNodeInput& input, NodeNumbering& numbering);
    SixNodeSheet(const SixNodeSheet&) = delete;
    SixNodeSheet& operator=(const SixNodeSheet&) = delete;

    Index n_elements() const override { return n_faces(); }
    std::span<const Index> nodes_of(Index face) const override { return stencils[face].nodes; }
    std::span<const Index> scalars_of(Index face) const override { return stencils[face].rotations; }
    Index n_folds() const override { return static_cast<Index>(folds.size()); }
    Index element_of_fold(Index fold) const override { return folds[fold].first_face(); }

    /// Once all nodes are numbered; as Sheet::add_folds.
    void add_folds(const SixNodeInput& input, const std::vector<DirectedEdge>& directed, Nodes& nodes);

    Index n_faces() const { return faces.size(); }
    /// Rotations of the caller: two an edge, at its Gauss points from the lower to the higher corner.
    Index n_edge_rotations() const { return static_cast<Index>(rotation_of.size()); }
    void place_rotations(std::vector<Vec3>& points, Index first_scalar) const;
    double extent() const;
    /// Adds the area of each face to its nodes, in equal shares, among all unknowns [m2].
    void add_areas(VectorXd& metric) const;
    double largest_coordinate(Index face) const;
    double smallest_height(Index face) const;

    struct Stencil {
        std::array<Index, 15> nodes;     // its own six, then three beyond each edge: see add_stencils
        std::array<Index, 6> rotations;  // of edge i at point g: 2 i + g
    };

    const std::string owner;
    Renumbering faces;                            // the caller's <-> ours
    std::vector<std::array<Index, 6>> own_nodes;  // per face
    std::vector<std::array<Vec3, 6>> rest;        // [m]
    std::vector<FoldSixStencil> folds;
    std::vector<std::array<FaceSideSix, 3>> sides;  // per face
    std::vector<Stencil> stencils;
    Index first_rotation = 0;
    std::vector<Index> rotation_of;  // the caller's -> scalar, or -1

  private:
    void add_stencils();
};

}  // namespace magshell
