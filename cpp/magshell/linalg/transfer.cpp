#include "magshell/linalg/transfer.h"

#include <algorithm>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace magshell {
namespace {

using slabs::lanes;
using slabs::Lanes;
using slabs::Triangle;
using slabs::width;

// Moves lanes of one slab to the lanes of another, column after column.
class LaneMove {
  public:
#ifdef __AVX512F__
    explicit LaneMove(const Transfer& transfer) {
        const __m128i from = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(transfer.from.data()));
        index_ = _mm512_maskz_cvtepu8_epi64(0xff, from);
        wanted_ = _mm512_cmplt_epi64_mask(index_, _mm512_set1_epi64(width));
    }
    void add(const double* source, double* target) const {
        const __m512d moved = _mm512_maskz_permutexvar_pd(wanted_, index_, _mm512_load_pd(source));
        _mm512_store_pd(target, _mm512_add_pd(_mm512_load_pd(target), moved));
    }

  private:
    __m512i index_;
    __mmask8 wanted_;
#else
    explicit LaneMove(const Transfer& transfer) {
        for (int lane = 0; lane < width; ++lane) {
            if (transfer.from[lane] == width) continue;
            from_[count_] = transfer.from[lane];
            to_[count_++] = lane;
        }
    }
    void add(const double* source, double* target) const {
        for (int k = 0; k < count_; ++k) target[to_[k]] += source[from_[k]];
    }

  private:
    int count_ = 0;
    int from_[width], to_[width];
#endif
};

void add_columns(const Transfer& transfer, const double* source, double* target, const Index* places,
                 Index first, Index end) {
    const LaneMove move(transfer);
    for (Index j = first; j < end; ++j)
        move.add(source + width * j, target + std::ptrdiff_t{width} * places[j]);
}

}  // namespace

void add_to_panel(const AssemblyPlan& plan, Index child, double* work, const slabs::Panel& parent) {
    const FrontPlan& front = plan.fronts[child];
    const Triangle update{work + front.update};
    const Index* places = plan.places.data() + front.shape.rows;
    for (Index t = front.first_transfer; t < plan.fronts[child + 1].first_transfer; ++t) {
        const Transfer& transfer = plan.transfers[t];
        double* target = transfer.to_pivots ? parent.top.slab(transfer.parent_slab)
                                            : parent.below.slab(transfer.parent_slab);
        add_columns(transfer, update.slab(transfer.slab), target, places, 0,
                    std::min(transfer.end_column, front.rows_in_parent_pivots));
    }
}

void add_to_update(const AssemblyPlan& plan, Index child, double* work, const Triangle& parent) {
    const FrontPlan& front = plan.fronts[child];
    const Triangle update{work + front.update};
    const Index* places = plan.places.data() + front.shape.rows;
    for (Index t = front.first_transfer; t < plan.fronts[child + 1].first_transfer; ++t) {
        const Transfer& transfer = plan.transfers[t];
        if (transfer.to_pivots) continue;
        add_columns(transfer, update.slab(transfer.slab), parent.slab(transfer.parent_slab), places,
                    front.rows_in_parent_pivots, transfer.end_column);
    }
}

}  // namespace magshell
