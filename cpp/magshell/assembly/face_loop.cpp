#include "magshell/assembly/face_loop.h"

namespace magshell {

FaceLoop::FaceLoop(const Sheet& sheet, const Schedule& schedule, const SystemMatrix& matrix)
    : faces_(sheet.n_faces()), corners_(&sheet.corners), schedule_(schedule) {
    slots_.reserve(faces_);
    for (const std::array<Index, 3>& nodes : sheet.corners) slots_.push_back(pair_slots<3>(matrix, nodes));
}

}  // namespace magshell
