#include "magshell/assembly/schedule.h"

#include <algorithm>

#include "magshell/core/parallel.h"

namespace magshell {

Schedule::Schedule(Index elements, Index nodes, const std::function<std::vector<Index>(Index)>& nodes_of)
    : elements_(elements), chunks_((elements + chunk_length - 1) / chunk_length) {
    std::vector<std::vector<Index>> chunks_at(nodes), nodes_in(chunks_);
    for (Index c = 0; c < chunks_; ++c) {
        for (Index e = c * chunk_length; e < std::min(elements, (c + 1) * chunk_length); ++e)
            for (const Index node : nodes_of(e))
                if (node >= 0 && (chunks_at[node].empty() || chunks_at[node].back() != c)) {
                    chunks_at[node].push_back(c);
                    nodes_in[c].push_back(node);
                }
    }
    std::vector<Index> colour(chunks_, -1);
    for (Index c = 0; c < chunks_; ++c) {
        std::vector<bool> taken(colours_.size() + 1, false);
        for (const Index node : nodes_in[c])
            for (const Index other : chunks_at[node])
                if (colour[other] >= 0) taken[colour[other]] = true;
        colour[c] = static_cast<Index>(std::find(taken.begin(), taken.end(), false) - taken.begin());
        if (colour[c] == static_cast<Index>(colours_.size())) colours_.emplace_back();
        colours_[colour[c]].push_back(c);
    }
}

void Schedule::scatter(const std::function<void(Index, Index)>& body) const {
    for (const std::vector<Index>& chunks : colours_)
        parallel_for(static_cast<int>(chunks.size()), [&](int k) {
            const Index first = chunks[k] * chunk_length;
            body(first, std::min(elements_, first + chunk_length));
        });
}

void Schedule::each(const std::function<void(Index, Index)>& body) const {
    parallel_for(chunks_, [&](int c) {
        const Index first = c * chunk_length;
        body(first, std::min(elements_, first + chunk_length));
    });
}

double Schedule::sum(const std::function<double(Index, Index)>& body) const {
    std::vector<double> parts(chunks_);
    parallel_for(chunks_, [&](int c) {
        const Index first = c * chunk_length;
        parts[c] = body(first, std::min(elements_, first + chunk_length));
    });
    double total = 0.0;
    for (const double part : parts) total += part;
    return total;
}

std::size_t Schedule::bytes() const { return sizeof(*this) + chunks_ * sizeof(Index); }

}  // namespace magshell
