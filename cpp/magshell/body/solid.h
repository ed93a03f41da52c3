// A solid of tetrahedra with four or ten nodes, numbered along a space-filling curve, and its surface.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "magshell/body/body.h"
#include "magshell/body/surface.h"

namespace magshell {

/// The surface of a solid as a mesh of its own; for ten-node tetrahedra, four flat triangles per face.
struct SolidSurface {
    std::shared_ptr<const TriangleMesh> mesh;
    std::vector<Index> vertices;  // the scene vertex of each vertex of the mesh
};

class Solid final : public Body {
  public:
    /// elements (n_t, 4 or 10): rows of rest_positions (n, 3) [m], middle nodes in the order of strain/tetrahedron.h. vertices: the scene
    /// vertex of each row. Throws InvalidInput, naming the first such element, if a volume at an integration point is not
    /// positive.
    Solid(std::string owner, const Rows3& rest_positions, const std::vector<Index>& elements,
          int nodes_per_element, const std::vector<Index>& vertices, const SolidSurface& surface,
          NodeNumbering& numbering);
    Solid(const Solid&) = delete;
    Solid& operator=(const Solid&) = delete;

    Index n_elements() const override { return elements.size(); }
    std::span<const Index> nodes_of(Index element) const override {
        if (quadratic()) return quadratic_nodes[element];
        return linear_nodes[element];
    }

    bool quadratic() const { return linear_nodes.empty(); }
    const Surface* surface() const { return surface_.get(); }
    /// Returns twice the largest distance of a node from the center at rest [m], which rotations keep.
    double extent() const;
    /// Returns the smallest height of an element at rest, between its corners [m].
    double smallest_height() const;
    /// Adds an equal part of the volume of each element to each of its nodes, among all dofs [m3].
    void add_volumes(VectorXd& metric) const;
    double volume() const;
    /// Returns the rest position of a node of an element [m].
    Vec3 rest(Index element, int k) const { return rest_[element * width_ + k]; }

    const std::string owner;
    Renumbering elements;                            // the caller's <-> ours
    std::vector<std::array<Index, 4>> linear_nodes;  // per element: our nodes; one of the two is empty
    std::vector<std::array<Index, 10>> quadratic_nodes;

  private:
    template <class Element>
    void check_volumes() const;
    double volume_of(Index element) const;

    int width_;
    std::vector<Vec3> rest_;
    std::unique_ptr<Surface> surface_;
};

}  // namespace magshell
