#include "magshell/linalg/transfer.h"

#include <algorithm>
#include <vector>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "magshell/core/parallel.h"

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

// Calls body(transfer) for those of a child, on several threads where there are many. What lands in one slab
// of the parent is left to one of them.
template <class Body>
void for_transfers(const AssemblyPlan& plan, Index child, Body&& body) {
    constexpr Index part = 12;
    const Index first = plan.fronts[child].first_transfer, end = plan.fronts[child + 1].first_transfer;
    const auto each = [&](Index from, Index to) {
        for (Index t = from; t < to; ++t) body(plan.transfers[t]);
    };
    if (end - first <= 2 * part) return each(first, end);
    std::vector<Index> starts;
    for (Index t = first; t < end; ++t) {
        const bool new_slab = t == first ||
                              plan.transfers[t].parent_slab != plan.transfers[t - 1].parent_slab ||
                              plan.transfers[t].to_pivots != plan.transfers[t - 1].to_pivots;
        if (new_slab && (starts.empty() || t - starts.back() >= part)) starts.push_back(t);
    }
    parallel_for(static_cast<int>(starts.size()), [&](int k) {
        each(starts[k], k + 1 < static_cast<int>(starts.size()) ? starts[k + 1] : end);
    });
}

}  // namespace

void add_to_panel(const AssemblyPlan& plan, Index child, double* work, const slabs::Panel& parent) {
    const FrontPlan& front = plan.fronts[child];
    const Triangle update{work + front.update};
    const Index* places = plan.places.data() + front.shape.rows;
    for_transfers(plan, child, [&](const Transfer& transfer) {
        double* target = transfer.to_pivots ? parent.top.slab(transfer.parent_slab)
                                            : parent.below.slab(transfer.parent_slab);
        add_columns(transfer, update.slab(transfer.slab), target, places, 0,
                    std::min(transfer.end_column, front.rows_in_parent_pivots));
    });
}

void add_to_update(const AssemblyPlan& plan, Index child, double* work, const Triangle& parent) {
    const FrontPlan& front = plan.fronts[child];
    const Triangle update{work + front.update};
    const Index* places = plan.places.data() + front.shape.rows;
    for_transfers(plan, child, [&](const Transfer& transfer) {
        if (transfer.to_pivots) return;
        add_columns(transfer, update.slab(transfer.slab), parent.slab(transfer.parent_slab), places,
                    front.rows_in_parent_pivots, transfer.end_column);
    });
}

}  // namespace magshell
