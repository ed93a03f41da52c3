// What every term on faces shares: fetching the corners of a pack of faces, and adding forces and blocks to them.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/assembly/schedule.h"

namespace magshell {

class FaceLoop {
  public:
    /// Of a surface's own triangles, or of others in their place.
    FaceLoop(const std::vector<std::array<Index, 3>>& corners, const ChunkLoop& chunks,
             const SystemMatrix& matrix);

    Index packs() const { return packs_for(faces_); }
    int lanes_in(Index pack) const { return std::min(Pack::width, faces_ - pack * Pack::width); }
    Index face(Index pack, int lane) const { return element_of(pack, lane, faces_); }

    void gather(Index pack, const double* q, Pack3 x[3]) const {
        for (int lane = 0; lane < Pack::width; ++lane) {
            const std::array<Index, 3>& nodes = (*corners_)[face(pack, lane)];
            for (int k = 0; k < 3; ++k) set_lane(x[k], lane, q + 3 * nodes[k]);
        }
    }

    void scatter(Index pack, const Pack3 g[3], Residual& out) const {
        for (int lane = 0; lane < lanes_in(pack); ++lane)
            for (int k = 0; k < 3; ++k) scatter_node(out, (*corners_)[face(pack, lane)][k], g[k], lane);
    }

    void scatter(Index pack, const Pack33 h[6], SystemMatrix& out) const {
        for (int lane = 0; lane < lanes_in(pack); ++lane) {
            const Index f = face(pack, lane);
            scatter_blocks<3>(out, (*corners_)[f], slots_[f], h, lane);
        }
    }

    /// body(pack) for the packs of a chunk.
    template <class Body>
    static void over_packs(const Chunk& chunk, const Body& body) {
        for (Index pack = chunk.first / Pack::width; pack < packs_for(chunk.last); ++pack) body(pack);
    }

    /// body(pack) for all packs, in the schedule's order, where body scatters.
    template <class Body>
    void scatter_packs(const Body& body) const {
        chunks_.scatter([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// body(pack) for all packs, where body writes only what belongs to them.
    template <class Body>
    void each_pack(const Body& body) const {
        chunks_.each([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// The sum of energy(pack) over the faces.
    template <class Energy>
    double sum(const Energy& energy) const {
        return chunks_.sum([&](const Chunk& chunk) {
            double total = 0.0;
            over_packs(chunk, [&](Index pack) {
                const Pack shares = energy(pack);
                for (int lane = 0; lane < lanes_in(pack); ++lane) total += shares[lane];
            });
            return total;
        });
    }

    std::size_t bytes() const { return bytes_of(slots_); }

  private:
    Index faces_;
    const std::vector<std::array<Index, 3>>* corners_;
    const ChunkLoop& chunks_;
    std::vector<PairSlots<3>> slots_;
};

}  // namespace magshell
