// Triangles on nodes that a solid has, with chunks of their own: what is assembled by them comes on top of the solid.
#pragma once

#include "magshell/body/body.h"
#include "magshell/body/surface.h"

namespace magshell {

class SurfaceBody final : public Body {
  public:
    /// The surface has to outlive it.
    explicit SurfaceBody(const Surface& surface) : surface_(surface) {}

    Index n_elements() const override { return surface_.n_faces(); }
    std::span<const Index> nodes_of(Index element) const override { return surface_.corners[element]; }

  private:
    const Surface& surface_;
};

}  // namespace magshell
