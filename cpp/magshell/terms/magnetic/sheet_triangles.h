// SheetTriangles: the flat triangles of a magnetized sheet, on whose edges its magnetization has sources (energy/own_field.h). A six-node face
// is four of them, between its nodes.
#pragma once

#include <vector>

#include "magshell/body/six_node_shell.h"
#include "magshell/body/surface.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/energy/own_field.h"

namespace magshell {

class SheetTriangles {
  public:
    /// The surface or shell must outlive this object.
    SheetTriangles(const Surface& surface, MagnetizationLaw law) : surface_(&surface), law_(law) {}
    SheetTriangles(const SixNodeShell& shell, MagnetizationLaw law) : shell_(&shell), law_(law) {}

    const std::string& owner() const { return surface_ ? surface_->owner : shell_->owner; }
    const Renumbering& faces() const { return surface_ ? surface_->faces : shell_->faces; }
    Index n_faces() const { return surface_ ? surface_->n_faces() : shell_->n_faces(); }
    /// Returns the number of triangles of a face.
    Index per_face() const { return surface_ ? 1 : 4; }
    Index n_triangles() const { return per_face() * n_faces(); }
    /// Adds the triangles, face by face.
    void add_to(OwnField::Faces& out) const;

  private:
    const Surface* surface_ = nullptr;
    const SixNodeShell* shell_ = nullptr;
    MagnetizationLaw law_;
};

/// Returns the triangles of all sheets, one sheet after another.
OwnField::Faces triangles_of(const std::vector<SheetTriangles>& sheets);

}  // namespace magshell
