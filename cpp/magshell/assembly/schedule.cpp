#include "magshell/assembly/schedule.h"

#include <algorithm>

#include "magshell/core/pack.h"
#include "magshell/core/parallel.h"

namespace magshell {
namespace {

// Elements of a chunk: 512 faces are about 600 kB of Hessian, slots and element data; small bodies are to have a few
// chunks of each colour, too. Tetrahedra of four nodes take a quarter of a face's memory, and share more nodes with the
// chunks beside theirs, so theirs are longer where there are enough of them. Whole packs.
Index part_length(const Body& of) {
    constexpr Index shortest = 128, longest = 512, chunks = 8, longest_of_four = 2048, chunks_of_four = 32;
    const Index elements = of.n_elements();
    Index length = std::clamp(elements / chunks, shortest, longest);
    if (elements > 0 && of.n_folds() == 0 && of.nodes_of(0).size() == 4)
        length = std::max(length, std::min(elements / chunks_of_four, longest_of_four));
    return length / Pack::width * Pack::width;
}

}  // namespace

Schedule::Schedule(Index nodes, const std::vector<const Body*>& bodies) : loops_(bodies.size()) {
    for (Index body = 0; body < static_cast<Index>(bodies.size()); ++body) cut(*bodies[body], body);
    colour(nodes, bodies);
}

void Schedule::cut(const Body& of, Index body) {
    Index fold = 0;
    const Index elements = of.n_elements(), folds = of.n_folds(), length = part_length(of);
    for (Index first = 0; first < elements; first += length) {
        const Index last = std::min(elements, first + length);
        const Index first_fold = fold;
        while (fold < folds && of.element_of_fold(fold) < last) ++fold;
        const Chunk chunk{static_cast<Index>(all_.chunks_.size()), body, first, last, first_fold, fold};
        all_.chunks_.push_back(chunk);
        loops_[body].chunks_.push_back(chunk);
    }
}

void Schedule::colour(Index nodes, const std::vector<const Body*>& bodies) {
    const Index count = static_cast<Index>(all_.chunks_.size());
    std::vector<std::vector<Index>> chunks_at(nodes), nodes_in(count);
    for (const Chunk& chunk : all_.chunks_)
        for (Index element = chunk.first; element < chunk.last; ++element)
            for (const Index node : bodies[chunk.body]->nodes_of(element))
                if (node >= 0 && (chunks_at[node].empty() || chunks_at[node].back() != chunk.number)) {
                    chunks_at[node].push_back(chunk.number);
                    nodes_in[chunk.number].push_back(node);
                }
    std::vector<Index> colour_of(count, -1);
    std::vector<std::vector<Index>>& colours = all_.colours_;
    for (Index p = 0; p < count; ++p) {
        std::vector<bool> taken(colours.size() + 1, false);
        for (const Index node : nodes_in[p])
            for (const Index other : chunks_at[node])
                if (colour_of[other] >= 0) taken[colour_of[other]] = true;
        colour_of[p] = static_cast<Index>(std::find(taken.begin(), taken.end(), false) - taken.begin());
        if (colour_of[p] == static_cast<Index>(colours.size())) colours.emplace_back();
        colours[colour_of[p]].push_back(p);
    }
    for (ChunkLoop& loop : loops_) {
        loop.colours_.resize(colours.size());
        for (Index k = 0; k < static_cast<Index>(loop.chunks_.size()); ++k)
            loop.colours_[colour_of[loop.chunks_[k].number]].push_back(k);
        std::erase_if(loop.colours_, [](const std::vector<Index>& chunks) { return chunks.empty(); });
    }
}

std::vector<Chunk> Schedule::in_order() const {
    std::vector<Chunk> order;
    for (const std::vector<Index>& chunks : all_.colours_)
        for (const Index p : chunks) order.push_back(all_.chunks_[p]);
    return order;
}

std::size_t Schedule::bytes() const {
    return 2 * all_.chunks_.size() * (sizeof(Chunk) + sizeof(Index));
}

void ChunkLoop::scatter(const std::function<void(const Chunk&)>& body) const {
    for (const std::vector<Index>& chunks : colours_)
        parallel_for(static_cast<int>(chunks.size()), [&](int k) { body(chunks_[chunks[k]]); });
}

void ChunkLoop::each(const std::function<void(const Chunk&)>& body) const {
    parallel_for(static_cast<int>(chunks_.size()), [&](int p) { body(chunks_[p]); });
}

double ChunkLoop::sum(const std::function<double(const Chunk&)>& body) const {
    std::vector<double> shares(chunks_.size());
    parallel_for(static_cast<int>(chunks_.size()), [&](int p) { shares[p] = body(chunks_[p]); });
    double total = 0.0;
    for (const double share : shares) total += share;
    return total;
}

}  // namespace magshell
