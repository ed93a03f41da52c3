#include "magshell/assembly/face_loop.h"

namespace magshell {

FaceLoop::FaceLoop(const std::vector<std::array<Index, 3>>& corners, const ChunkLoop& chunks,
                   const SystemMatrix& matrix)
    : faces_(static_cast<Index>(corners.size())), corners_(&corners), chunks_(chunks) {
    slots_.reserve(faces_);
    for (const std::array<Index, 3>& nodes : corners) slots_.push_back(pair_slots<3>(matrix, nodes));
}

}  // namespace magshell
