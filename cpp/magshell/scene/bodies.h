// The bodies of a scene in the core's numbering.
#pragma once

#include <memory>
#include <vector>

#include "magshell/body/fibres.h"
#include "magshell/body/sheet.h"
#include "magshell/body/six_node_sheet.h"
#include "magshell/body/solid.h"
#include "magshell/body/surface_body.h"

namespace magshell {

struct RigidInput;
struct SceneInput;

class Bodies {
  public:
    explicit Bodies(const SceneInput& input);

    const Nodes& nodes() const { return nodes_; }
    const std::vector<const Sheet*>& sheets() const { return sheets_; }
    const std::vector<const Solid*>& solids() const { return solids_; }
    const std::vector<const SixNodeSheet*>& six_node_sheets() const { return six_node_sheets_; }
    /// Which of all() each of them is.
    const std::vector<Index>& six_node_bodies() const { return six_node_bodies_; }
    /// Sheets, then solids, then the surfaces of solids that something acts on, then skins, then sheets of six-node faces,
    /// then the surfaces of those that something acts on, then fibres of muscles.
    const std::vector<const Body*>& all() const { return all_; }
    /// Triangles of bodies, and which of all() has their chunks: of sheets, of solids (none where nothing acts on them), of
    /// skins, of sheets of six-node faces (as of solids).
    struct Faces {
        const Surface* surface = nullptr;
        Index body = -1;
    };
    const std::vector<Faces>& faces() const { return faces_; }
    /// Of each muscle, and which of all() has their chunks.
    struct OfMuscle {
        const Fibres* fibres;
        Index body;
    };
    const std::vector<OfMuscle>& fibres() const { return fibres_; }
    /// The nodes of each rigid part, its own first.
    const std::vector<std::vector<Index>>& rigid_nodes() const { return rigid_nodes_; }
    /// How many those are: ten, and the vertices of its surface.
    Index n_own(std::size_t part) const { return static_cast<Index>(rigid_points_[part].rows()); }
    /// Of the smallest rigid part, half the edge of the cube around its tetrahedron [m]; infinite without.
    double rigid_length() const;
    /// How many vertices the caller's sheets and solids have; those of rigid parts follow.
    Index n_body_vertices() const { return n_body_vertices_; }
    /// Of all sheets, one after another, in the caller's numbers.
    Index n_edges() const { return n_edges_; }
    /// What each element of a sheet couples, and each couple.
    std::vector<Stencil> stencils(const SceneInput& input) const;

    /// What each element of a solid or of a sheet of six-node faces couples, the corners of rigid parts that a joint
    /// couples, and what volumes and tendons couple beyond that.
    std::vector<Clique> cliques() const;

    VectorXd rest_state() const;
    /// All unknowns from the caller's positions (n_v, 3) and edge rotations (n_e,); a rigid part's own points at rest.
    VectorXd state(const Rows3& positions, const VectorXd& edge_rotations) const;
    /// Vectors of the caller's vertices among all unknowns, zero elsewhere; welded ones have one. Rows of the
    /// bodies' vertices, or of points() too.
    VectorXd vectors(const Rows3& of_vertices) const;
    /// A gradient by the caller's positions and edge rotations as one by all unknowns: the transpose of positions(),
    /// or of points().
    VectorXd gradient_by_state(const Rows3& by_positions, const VectorXd& by_edge_rotations) const;
    /// Of the bodies' vertices; and of the points of rigid parts too.
    Rows3 positions(const VectorXd& q) const { return rows(q, n_body_vertices_); }
    Rows3 points(const VectorXd& q) const { return rows(q, nodes_.n_user_vertices()); }
    /// A gradient by unknowns as one by the caller's positions: the transpose of vectors().
    Rows3 gradient_by_vectors(const VectorXd& by_q) const;
    VectorXd edge_rotations(const VectorXd& q) const;
    /// One number a vertex of the caller, points of rigid parts too, as one for each unknown; zero for all others.
    /// Those of welded vertices are added up.
    VectorXd vertex_weights(const VectorXd& by_vertex) const;

    /// Where each unknown is at rest [m]: its vertex, or the middle of its edge.
    std::vector<Vec3> unknown_points() const;
    /// Of the largest body: the diagonal of its bounding box at rest [m].
    double extent() const;
    /// The largest coordinate at rest [m].
    double reach() const;
    /// Area at each unknown of a vertex, zero for all others; of a solid, its volume over the root of the whole [m2].
    VectorXd area_metric() const;

  private:
    void add_rotations(const VectorXd& of_edges, VectorXd& q) const;
    Rows3 rows(const VectorXd& q, Index count) const;
    void add_surface(const Surface* surface);
    void add_rigid(const std::vector<RigidInput>& rigid, NodeNumbering& numbering);
    void couple_links(const SceneInput& input);
    void couple_volumes_and_tendons(const SceneInput& input);

    std::vector<std::unique_ptr<Sheet>> owned_;
    std::vector<std::unique_ptr<Solid>> owned_solids_;
    std::vector<std::unique_ptr<SixNodeSheet>> owned_six_node_sheets_;
    std::vector<std::unique_ptr<Surface>> owned_skins_;  // then the flat triangles of six-node sheets
    std::vector<std::unique_ptr<SurfaceBody>> owned_surfaces_;
    std::vector<std::unique_ptr<Fibres>> owned_fibres_;
    std::vector<const Sheet*> sheets_;
    std::vector<const Solid*> solids_;
    std::vector<const SixNodeSheet*> six_node_sheets_;
    std::vector<Index> six_node_bodies_;
    std::vector<const Body*> all_;
    std::vector<Faces> faces_;
    std::vector<OfMuscle> fibres_;
    Nodes nodes_;
    std::vector<Index> copies_;  // the caller's vertices that are welded to an earlier one
    Index n_edges_ = 0, n_body_vertices_ = 0;
    std::vector<std::vector<Index>> rigid_nodes_;
    std::vector<Rows3> rigid_points_;
    std::vector<std::vector<Index>> coupled_;
};

}  // namespace magshell
