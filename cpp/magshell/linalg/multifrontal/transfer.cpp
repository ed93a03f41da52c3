#include "magshell/linalg/multifrontal/transfer.h"

#include <algorithm>
#include <vector>

#include "magshell/core/parallel.h"
#include "magshell/linalg/multifrontal/dense_kernels.h"

namespace magshell {
namespace {

using slabs::Triangle;

// Calls body(transfer) for all transfers of a child, on several threads if there are many. All transfers to one
// slab of the parent go to the same thread.
template <class Body>
void for_transfers(const AssemblyPlan& plan, Index child, Body&& body) {
    constexpr Index part = 12;  // [slabs] per task; time only, the sums do not depend on it; plain-words: ok
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
        dense_kernels().add_columns(transfer, update.slab(transfer.slab), target, places, 0,
                                    std::min(transfer.end_column, front.rows_in_parent_pivots));
    });
}

void add_to_update(const AssemblyPlan& plan, Index child, double* work, const Triangle& parent) {
    const FrontPlan& front = plan.fronts[child];
    const Triangle update{work + front.update};
    const Index* places = plan.places.data() + front.shape.rows;
    for_transfers(plan, child, [&](const Transfer& transfer) {
        if (transfer.to_pivots) return;
        dense_kernels().add_columns(transfer, update.slab(transfer.slab), parent.slab(transfer.parent_slab),
                                    places, front.rows_in_parent_pivots, transfer.end_column);
    });
}

}  // namespace magshell
