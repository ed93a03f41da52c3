// A tree of boxes around the faces of a surface, that is put around them again wherever they move.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "magshell/contact/contact_surface.h"
#include "magshell/mesh/box_tree.h"

namespace magshell {

/// Where all nodes are: at `from`, or anywhere on straight ways from there to `to`; three numbers each.
struct NodePaths {
    const double* from;
    const double* to;

    explicit NodePaths(const double* at) : from(at), to(at) {}
    NodePaths(const double* begin, const double* end) : from(begin), to(end) {}

    bool still() const { return from == to; }
    /// Around some nodes.
    Bounds around(std::span<const Index> nodes) const;
};

class FaceBoxes {
  public:
    /// The surface has to outlive it.
    explicit FaceBoxes(const ContactSurface& surface) : surface_(&surface) {}

    /// Puts the boxes around the faces. What is near does not depend on how the tree was made, only the time does: it
    /// is made anew when its boxes have grown to overlap.
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
    double measure_ = 0.0;  // of the boxes when the tree was made
};

/// visit(task, f, g) for the pairs of a face of a and one of b whose boxes are within `margin` of each other along every
/// axis; where a and b are the same, each pair of different faces once. Tasks may run at the same time: prepare(n) says
/// how many there are.
void near_faces(const FaceBoxes& a, const FaceBoxes& b, double margin,
                const std::function<void(int)>& prepare, const std::function<void(int, Index, Index)>& visit);

}  // namespace magshell
