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

Schedule::Schedule(Index nodes, const std::vector<const Sheet*>& bodies) : loops_(bodies.size()) {
    for (Index body = 0; body < static_cast<Index>(bodies.size()); ++body) cut(*bodies[body], body);
    colour(nodes, bodies);
}

void Schedule::cut(const Sheet& sheet, Index body) {
    Index fold = 0;
    const Index folds = static_cast<Index>(sheet.folds.size());
    const Index length = part_length(sheet.n_faces());
    for (Index first = 0; first < sheet.n_faces(); first += length) {
        const Index last = std::min(sheet.n_faces(), first + length);
        const Index first_fold = fold;
        while (fold < folds && sheet.folds[fold].first_face() < last) ++fold;
        const Part part{static_cast<Index>(all_.parts_.size()), body, first, last, first_fold, fold};
        all_.parts_.push_back(part);
        loops_[body].parts_.push_back(part);
    }
}

void Schedule::colour(Index nodes, const std::vector<const Sheet*>& bodies) {
    const Index count = static_cast<Index>(all_.parts_.size());
    std::vector<std::vector<Index>> parts_at(nodes), nodes_in(count);
    for (const Part& part : all_.parts_)
        for (Index element = part.first; element < part.last; ++element)
            for (const Index node : bodies[part.body]->stencils[element].nodes)
                if (node >= 0 && (parts_at[node].empty() || parts_at[node].back() != part.number)) {
                    parts_at[node].push_back(part.number);
                    nodes_in[part.number].push_back(node);
                }
    std::vector<Index> colour_of(count, -1);
    std::vector<std::vector<Index>>& colours = all_.colours_;
    for (Index p = 0; p < count; ++p) {
        std::vector<bool> taken(colours.size() + 1, false);
        for (const Index node : nodes_in[p])
            for (const Index other : parts_at[node])
                if (colour_of[other] >= 0) taken[colour_of[other]] = true;
        colour_of[p] = static_cast<Index>(std::find(taken.begin(), taken.end(), false) - taken.begin());
        if (colour_of[p] == static_cast<Index>(colours.size())) colours.emplace_back();
        colours[colour_of[p]].push_back(p);
    }
    for (PartLoop& loop : loops_) {
        loop.colours_.resize(colours.size());
        for (Index k = 0; k < static_cast<Index>(loop.parts_.size()); ++k)
            loop.colours_[colour_of[loop.parts_[k].number]].push_back(k);
        std::erase_if(loop.colours_, [](const std::vector<Index>& parts) { return parts.empty(); });
    }
}

std::vector<Part> Schedule::in_order() const {
    std::vector<Part> order;
    for (const std::vector<Index>& parts : all_.colours_)
        for (const Index p : parts) order.push_back(all_.parts_[p]);
    return order;
}

std::size_t Schedule::bytes() const {
    return 2 * all_.parts_.size() * (sizeof(Part) + sizeof(Index));
}

void PartLoop::scatter(const std::function<void(const Part&)>& body) const {
    for (const std::vector<Index>& parts : colours_)
        parallel_for(static_cast<int>(parts.size()), [&](int k) { body(parts_[parts[k]]); });
}

void PartLoop::each(const std::function<void(const Part&)>& body) const {
    parallel_for(static_cast<int>(parts_.size()), [&](int p) { body(parts_[p]); });
}

double PartLoop::sum(const std::function<double(const Part&)>& body) const {
    std::vector<double> shares(parts_.size());
    parallel_for(static_cast<int>(parts_.size()), [&](int p) { shares[p] = body(parts_[p]); });
    double total = 0.0;
    for (const double share : shares) total += share;
    return total;
}

}  // namespace magshell
