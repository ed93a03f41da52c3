#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "magshell/linalg/multifrontal/dense_kernels.h"

namespace magshell {
namespace {

using slabs::width;

// Moves lanes of one slab to lanes of another, column after column.
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

}  // namespace

inline namespace MAGSHELL_FAMILY {

void add_columns(const Transfer& transfer, const double* source, double* target, const Index* places,
                 Index first, Index end) {
    const LaneMove move(transfer);
    for (Index j = first; j < end; ++j)
        move.add(source + width * j, target + std::ptrdiff_t{width} * places[j]);
}

}  // namespace MAGSHELL_FAMILY
}  // namespace magshell
