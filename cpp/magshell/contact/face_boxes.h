// FaceBoxes: a tree of bounding boxes around the faces of a surface, which is updated when the nodes move.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "magshell/contact/contact_surface.h"
#include "magshell/mesh/box_tree.h"

namespace magshell {

/// The positions of all nodes at `from`, or along straight paths from there to `to`; three numbers per node.
struct NodePaths {
    const double* from;
    const double* to;

    explicit NodePaths(const double* at) : from(at), to(at) {}
    NodePaths(const double* begin, const double* end) : from(begin), to(end) {}

    bool still() const { return from == to; }
    /// Returns the bounding box of some nodes.
    Bounds around(std::span<const Index> nodes) const;
};

class FaceBoxes {
  public:
    /// Stores a reference to the surface, which must outlive the object.
    explicit FaceBoxes(const ContactSurface& surface) : surface_(&surface) {}

    /// Updates the boxes. The tree is rebuilt when its boxes have come to overlap too much, which affects the
    /// time of a search but not its result.
    void fit(const NodePaths& ways);
    const std::vector<BoxTree::Node>& nodes() const { return nodes_; }
    const std::vector<Index>& items() const { return items_; }
    const Bounds& box(Index face) const { return boxes_[face]; }
    std::size_t bytes() const;

  private:
    void make();
    double refit();

    const ContactSurface* surface_;
    std::vector<Bounds> boxes_;
    std::vector<BoxTree::Node> nodes_;
    std::vector<Index> items_;
    double measure_ = 0.0;  // overlap measure of the boxes when the tree was built
};

/// Calls visit(task, f, g) for each pair of a face of a and one of b whose boxes are within `margin` of each
/// other along every axis; if a and b are the same, for each pair of different faces once. Tasks may run at the
/// same time: prepare(n) is called before with their number.
void near_faces(const FaceBoxes& a, const FaceBoxes& b, double margin,
                const std::function<void(int)>& prepare, const std::function<void(int, Index, Index)>& visit);

}  // namespace magshell
