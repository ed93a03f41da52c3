#include "magshell/assembly/face_loop.h"

namespace magshell {

FaceLoop::FaceLoop(const Surface& surface, const PartLoop& parts, const SystemMatrix& matrix)
    : faces_(surface.n_faces()), corners_(&surface.corners), parts_(parts) {
    slots_.reserve(faces_);
    for (const std::array<Index, 3>& nodes : surface.corners) slots_.push_back(pair_slots<3>(matrix, nodes));
}

}  // namespace magshell
