#include "magshell/assembly/schedule.h"

#include <algorithm>

#include "magshell/core/pack.h"
#include "magshell/core/parallel.h"

namespace magshell {
namespace {

// Faces of a part: 512 are about 600 kB of Hessian, slots and element data; small sheets are to have a few
// parts of each colour, too. Whole packs.
Index part_length(Index faces) {
    constexpr Index shortest = 128, longest = 512, parts = 8;
    return std::clamp(faces / parts / Pack::width * Pack::width, shortest, longest);
}

}  // namespace

Schedule::Schedule(const Sheet& sheet) {
    Index fold = 0;
    const Index folds = static_cast<Index>(sheet.folds.size());
    const Index length = part_length(sheet.n_faces());
    for (Index first = 0; first < sheet.n_faces(); first += length) {
        const Index last = std::min(sheet.n_faces(), first + length);
        const Index first_fold = fold;
        while (fold < folds && sheet.folds[fold].first_face() < last) ++fold;
        parts_.push_back({static_cast<Index>(parts_.size()), first, last, first_fold, fold});
    }
    colour(sheet);
}

void Schedule::colour(const Sheet& sheet) {
    const Index count = static_cast<Index>(parts_.size());
    std::vector<std::vector<Index>> parts_at(sheet.n_nodes()), nodes_in(count);
    for (Index p = 0; p < count; ++p)
        for (Index f = parts_[p].first_face; f < parts_[p].last_face; ++f)
            for (const Index node : sheet.stencils[f].nodes)
                if (node >= 0 && (parts_at[node].empty() || parts_at[node].back() != p)) {
                    parts_at[node].push_back(p);
                    nodes_in[p].push_back(node);
                }
    std::vector<Index> colour_of(count, -1);
    for (Index p = 0; p < count; ++p) {
        std::vector<bool> taken(colours_.size() + 1, false);
        for (const Index node : nodes_in[p])
            for (const Index other : parts_at[node])
                if (colour_of[other] >= 0) taken[colour_of[other]] = true;
        colour_of[p] = static_cast<Index>(std::find(taken.begin(), taken.end(), false) - taken.begin());
        if (colour_of[p] == static_cast<Index>(colours_.size())) colours_.emplace_back();
        colours_[colour_of[p]].push_back(p);
    }
}

std::vector<Part> Schedule::in_order() const {
    std::vector<Part> order;
    for (const std::vector<Index>& parts : colours_)
        for (const Index p : parts) order.push_back(parts_[p]);
    return order;
}

void Schedule::scatter(const std::function<void(const Part&)>& body) const {
    for (const std::vector<Index>& parts : colours_)
        parallel_for(static_cast<int>(parts.size()), [&](int k) { body(parts_[parts[k]]); });
}

void Schedule::each(const std::function<void(const Part&)>& body) const {
    parallel_for(static_cast<int>(parts_.size()), [&](int p) { body(parts_[p]); });
}

double Schedule::sum(const std::function<double(const Part&)>& body) const {
    std::vector<double> shares(parts_.size());
    parallel_for(static_cast<int>(parts_.size()), [&](int p) { shares[p] = body(parts_[p]); });
    double total = 0.0;
    for (const double share : shares) total += share;
    return total;
}

std::size_t Schedule::bytes() const {
    return parts_.size() * (sizeof(Part) + sizeof(Index));
}

}  // namespace magshell
