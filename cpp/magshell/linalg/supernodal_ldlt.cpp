#include "magshell/linalg/supernodal_ldlt.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/linalg/equilibration.h"
#include "magshell/linalg/front.h"
#include "magshell/linalg/ordering.h"
#include "magshell/linalg/transfer.h"

namespace magshell {

using slabs::Panel;
using slabs::Triangle;
using slabs::width;

namespace {

constexpr double doubtful_growth = 1e8;  // half of the digits are gone: check before claiming success

}  // namespace

SupernodalLdlt::SupernodalLdlt(const SparsePattern& pattern, Ordering ordering)
    : SupernodalLdlt(analysed(pattern, ordering)) {}

std::shared_ptr<const SupernodalLdlt::Analysis> SupernodalLdlt::analysed(const SparsePattern& pattern,
                                                                         Ordering ordering) {
    AssemblyTree tree = ordered_assembly_tree(pattern, ordering);
    Analysis analysis{pattern, {}, tree.nonzeros(), tree.flops()};
    analysis.plan = assembly_plan(pattern, std::move(tree));
    return std::make_shared<const Analysis>(std::move(analysis));
}

SupernodalLdlt::SupernodalLdlt(std::shared_ptr<const Analysis> analysis) : analysis_(std::move(analysis)) {
    scaled_values_.resize(pattern_.rows.size());
    scale_.resize(pattern_.size);
    diagonal_.resize(pattern_.size);
    coupling_.resize(pattern_.size);
    pivot_order_.resize(pattern_.size);
    report_.reason = "factorize() has not been called";
}

std::unique_ptr<Factor> SupernodalLdlt::sibling() const {
    return std::unique_ptr<Factor>(new SupernodalLdlt(analysis_));
}

FactorReport SupernodalLdlt::factorize(const double* values) {
    report_ = {};
    report_.reason = "the last factorize() did not finish";
    if (factor_.size() == 0) {  // an analysis that only has siblings needs none
        factor_ = slabs::Buffer(plan_.factor_doubles);
        work_ = slabs::Buffer(plan_.work_doubles);
    }
    largest_scaled_ = equilibrate(pattern_, values, scale_, scaled_values_);
    values_.assign(values, values + pattern_.rows.size());

    std::vector<PivotTally> tallies(plan_.subtrees.size());
    parallel_for(static_cast<int>(plan_.subtrees.size()), [&](int task) {
        const FrontRange& subtree = plan_.subtrees[task];
        for (Index s = subtree.begin; s < subtree.end; ++s) tallies[task].add(process(s));
    });
    PivotTally tally;
    for (const PivotTally& each : tallies) tally.add(each);
    for (const Index s : plan_.top) tally.add(process(s));

    report_.negative_pivots = tally.negative;
    report_.perturbed_pivots = tally.perturbed;
    report_.pivot_growth = largest_scaled_ > 0.0 ? tally.growth / largest_scaled_ : 0.0;
    report_.succeeded = true;
    report_.reason.clear();
    const bool doubtful = tally.perturbed > 0 || !(report_.pivot_growth < doubtful_growth);
    if (doubtful && !recovers_known_solution()) {
        report_.succeeded = false;
        report_.reason =
            tally.perturbed > 0
                ? "the matrix is singular to rounding: " + std::to_string(tally.perturbed) +
                      " of its pivots vanish. Does the model hold every rigid motion and mechanism?"
                : "the factorization lost its digits to the growth of its entries (see pivot_growth): the "
                  "matrix is "
                  "close to singular, or needs pivots from further away";
    }
    return report_;
}

PivotTally SupernodalLdlt::process(Index s) {
    const FrontPlan& front = plan_.fronts[s];
    const FrontShape& shape = front.shape;
    double* data = factor_.data() + front.panel;
    std::fill_n(data, Panel::doubles(shape.pivots, shape.below), 0.0);
    for (Index k = front.first_entry; k < plan_.fronts[s + 1].first_entry; ++k) {
        data[plan_.entries[k].place] = scaled_values_[plan_.entries[k].entry];
    }
    const Panel panel(data, shape.pivots);
    for (const Index child : front.children) add_to_panel(plan_, child, work_.data(), panel);

    const Pivots pivots{diagonal_.data() + shape.first, coupling_.data() + shape.first};
    const Index below_slabs = slabs::count(shape.below);
    PivotTally tally;
    eliminate_pivots(panel, shape.pivots, below_slabs, {pivots, pivot_order_.data() + shape.first}, tally);

    const Triangle update{work_.data() + front.update};
    form_update(panel, shape.pivots, below_slabs, pivots, update);
    for (const Index child : front.children) add_to_update(plan_, child, work_.data(), update);
    return tally;
}

std::size_t SupernodalLdlt::bytes() const {
    const std::size_t doubles = factor_.size() + work_.size() + 2 * pattern_.rows.size() + 3 * pattern_.size;
    return sizeof(double) * doubles + sizeof(Index) * (pattern_.rows.size() + 2 * plan_.rows.size()) +
           sizeof(PlacedEntry) * plan_.entries.size() + sizeof(Transfer) * plan_.transfers.size();
}

}  // namespace magshell
