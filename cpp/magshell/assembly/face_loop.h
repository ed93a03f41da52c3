// What every term on faces shares: of a surface's own triangles, or of others in their place.
#pragma once

#include "magshell/assembly/element_loop.h"

namespace magshell {

class FaceLoop : public ElementLoop<3> {
  public:
    using ElementLoop<3>::ElementLoop;

    Index face(Index pack, int lane) const { return element(pack, lane); }
};

}  // namespace magshell
