#include "magshell/linalg/multifrontal/supernodal_ldlt.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/dense_kernels.h"
#include "magshell/linalg/multifrontal/equilibration.h"
#include "magshell/linalg/multifrontal/slabs.h"
#include "magshell/linalg/ordering/ordering.h"

namespace magshell {

using slabs::Panel;
using slabs::Triangle;
using slabs::width;

namespace {

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

// Adds the part of a child's update that belongs to the parent's pivot columns ("extend-add"). `work` is the space that contains the
// update.
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

// Adds the rest, which belongs to the update of the parent itself.
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

// [-] pivot growth from which the matrix is factorized again with delayed pivots. Round-off grows by as much:
// below it solutions have about 12 digits, and eigenvalues above 1e-12 of the largest keep their sign. Fixed by
// test_saddle_points_are_solved_and_their_inertia_is_right
constexpr double doubtful_growth = 1e4;

}  // namespace

SupernodalLdlt::SupernodalLdlt(std::shared_ptr<const SparsePattern> pattern, const FactorOptions& options)
    : SupernodalLdlt(pattern, analysed(*pattern, options)) {}

std::shared_ptr<SupernodalLdlt::Analysis> SupernodalLdlt::analysed(const SparsePattern& pattern,
                                                                   const FactorOptions& options) {
    AssemblyTree tree = ordered_assembly_tree(pattern, options);
    options.watch();
    const std::shared_ptr<Analysis> analysis = std::make_shared<Analysis>();
    analysis->nonzeros = tree.nonzeros();
    analysis->flops = tree.flops();
    analysis->plan = assembly_plan(pattern, std::move(tree));
#ifdef __GLIBC__
    // [entries] above which the memory that orderings leave behind is returned; plain-words: ok
    constexpr std::size_t large = 1000000;
    if (pattern.rows.size() > large) malloc_trim(0);
#endif
    return analysis;
}

std::shared_ptr<SharedWork> SupernodalLdlt::Analysis::shared_work() {
    const std::lock_guard lock(mutex);
    std::shared_ptr<SharedWork> shared = work.lock();
    if (!shared) work = shared = std::make_shared<SharedWork>();
    return shared;
}

SupernodalLdlt::SupernodalLdlt(std::shared_ptr<const SparsePattern> pattern,
                               std::shared_ptr<Analysis> analysis)
    : Factor(std::move(pattern)), analysis_(std::move(analysis)) {
    scale_.resize(size());
    diagonal_.resize(size());
    coupling_.resize(size());
    pivot_order_.resize(size());
}

std::unique_ptr<Factor> SupernodalLdlt::sibling() const {
    return std::unique_ptr<Factor>(new SupernodalLdlt(pattern_, analysis_));
}

FactorReport SupernodalLdlt::factorize() {
    report_ = {};
    report_.reason = "the last factorize() did not finish";
    delayed_.reset();
    if (factor_.size() == 0) {  // an analysis that only has siblings needs none
        factor_ = slabs::Buffer(plan_.factor_doubles);
        work_ = analysis_->shared_work();
    }
    largest_scaled_ = equilibrate(*pattern_, values_, scale_);
    PivotTally tally = factorize_by_plan();
    if (is_doubtful(tally)) {
        largest_scaled_ = equilibrate_further(*pattern_, values_, scale_);
        delayed_ = std::make_unique<DelayedLdlt>(plan_, values_.data(), factor_.data());
        tally = delayed_->tally();
    }
    report_.negative_pivots = tally.negative;
    report_.perturbed_pivots = tally.perturbed;
    report_.pivot_growth = largest_scaled_ > 0.0 ? tally.growth / largest_scaled_ : 0.0;
    report_.succeeded = true;
    report_.reason.clear();
    if (delayed_ && !recovers_known_solution()) {
        report_.succeeded = false;
        report_.reason =
            tally.perturbed > 0
                ? "the matrix is singular to rounding: " + std::to_string(tally.perturbed) +
                      " of its pivots vanish. Does the model hold every rigid motion and mechanism?"
                : "the matrix is close to singular: its factorization does not recover a known solution. "
                  "Does "
                  "the model hold every rigid motion and mechanism?";
    }
    return report_;
}

bool SupernodalLdlt::is_doubtful(const PivotTally& tally) const {
    return tally.perturbed > 0 || !(tally.growth <= doubtful_growth * largest_scaled_);
}

PivotTally SupernodalLdlt::factorize_by_plan() {
    WorkMemory work = work_->take();
    if (work.shared.size() == 0) work.shared = slabs::Buffer(plan_.shared_doubles);
    const int subtrees = static_cast<int>(plan_.subtrees.size());
    const std::ptrdiff_t subtree_doubles = std::min(num_threads(), subtrees) * plan_.subtree_doubles;
    if (work.subtrees.size() < subtree_doubles) work.subtrees = slabs::Buffer(subtree_doubles);
    WorkSpaces spaces(work.subtrees, plan_.subtree_doubles);

    double* const shared = work.shared.data();
    std::vector<PivotTally> tallies(subtrees);
    parallel_for(subtrees, [&](int task) {
        const Subtree& subtree = plan_.subtrees[task];
        const Index root = subtree.end - 1;
        double* const own = spaces.of_this_thread();
        for (Index s = subtree.begin; s < root; ++s) tallies[task].add(process(s, own, own));
        tallies[task].add(process(root, own, shared));
    });
    PivotTally tally;
    for (const PivotTally& each : tallies) tally.add(each);
    for (const Index s : plan_.top) {
        if (is_doubtful(tally)) break;
        tally.add(process(s, shared, shared));
    }
    work_->give_back(std::move(work));
    return tally;
}

PivotTally SupernodalLdlt::process(Index s, double* from, double* to) {
    const FrontPlan& front = plan_.fronts[s];
    const FrontShape& shape = front.shape;
    double* data = factor_.data() + front.panel;
    std::fill_n(data, Panel::doubles(shape.pivots, shape.below), 0.0);
    for (Index k = front.first_entry; k < plan_.fronts[s + 1].first_entry; ++k) {
        data[plan_.entries[k].place] = values_[plan_.entries[k].entry];
    }
    const Panel panel(data, shape.pivots);
    for (const Index child : front.children) add_to_panel(plan_, child, from, panel);

    const Pivots pivots{diagonal_.data() + shape.first, coupling_.data() + shape.first};
    const Index below_slabs = slabs::count(shape.below);
    PivotTally tally;
    const DenseKernels& kernels = dense_kernels();
    kernels.eliminate_pivots(panel, shape.pivots, below_slabs, {pivots, pivot_order_.data() + shape.first},
                             tally);

    const Triangle update{to + front.update};
    kernels.form_update(panel, shape.pivots, below_slabs, pivots, update);
    for (const Index child : front.children) add_to_update(plan_, child, from, update);
    return tally;
}

std::size_t SupernodalLdlt::bytes() const {
    return own_bytes() + (work_ ? work_->bytes() : 0) +
           sizeof(Index) * (pattern_->rows.size() + 3 * plan_.rows.size()) +
           sizeof(RoutedEntry) * plan_.entries.size() + sizeof(Transfer) * plan_.transfers.size();
}

std::size_t SupernodalLdlt::own_bytes() const {
    return sizeof(double) * (factor_.size() + values_.size() + 3 * size()) + sizeof(Index) * size() +
           (delayed_ ? delayed_->bytes() : 0);
}

}  // namespace magshell
