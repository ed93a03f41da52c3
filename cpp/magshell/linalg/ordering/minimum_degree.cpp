#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#include "magshell/linalg/ordering/ordering.h"

namespace magshell {
namespace {

using Word = std::uint64_t;
constexpr int bits = 64;  // of a word; plain-words: ok

// The elimination graph as bit sets with a fixed number of words, which are processed in registers: one set for
// each of the first nodes, its row, and one for each binary digit of the weights.
template <int Words>
class EliminationGraph {
  public:
    using Set = std::array<Word, Words>;

    explicit EliminationGraph(Index rows) : rows_(rows) {}

    void couple(Index row, Index place) { rows_[row][place / bits] |= Word{1} << (place % bits); }

    void set_weight(Index place, Index weight) {
        for (std::size_t digit = 0; weight >> digit; ++digit) {
            if (digit == digits_.size()) digits_.emplace_back();
            if (weight >> digit & 1) digits_[digit][place / bits] |= Word{1} << (place % bits);
        }
    }

    /// Returns the total weight of the nodes that a row is coupled with.
    Index degree(Index row) const {
        Index sum = 0;
        for (std::size_t digit = 0; digit < digits_.size(); ++digit) {
            Word count = 0;
            for (int w = 0; w < Words; ++w) count += std::popcount(rows_[row][w] & digits_[digit][w]);
            sum += static_cast<Index>(count) << digit;
        }
        return sum;
    }

    /// Eliminates a node: couples all nodes that its row is coupled with, removes it, and visits the rows that
    /// have changed.
    template <class Visit>
    void eliminate(Index pivot, Visit&& visit) {
        const Set taken = rows_[pivot];
        for (int word = 0; word < Words; ++word) {
            for (Word ahead = taken[word]; ahead; ahead &= ahead - 1) {
                const Index row = bits * word + std::countr_zero(ahead);
                if (row >= static_cast<Index>(rows_.size())) return;
                Set& set = rows_[row];
                for (int w = 0; w < Words; ++w) set[w] |= taken[w];
                set[pivot / bits] &= ~(Word{1} << (pivot % bits));
                set[row / bits] &= ~(Word{1} << (row % bits));
                visit(row);
            }
        }
    }

  private:
    std::vector<Set> rows_, digits_;
};

// The nodes of a piece, followed by the adjacent nodes outside it.
struct Places {
    std::vector<Index> nodes, starts, coupled;  // for each node of the piece: the nodes it is coupled with
    std::vector<Index> weights;                 // of all nodes
};

template <int Words>
std::vector<Index> ordered(const Places& places) {
    const Index count = static_cast<Index>(places.nodes.size());
    EliminationGraph<Words> left(count);
    for (std::size_t k = 0; k < places.weights.size(); ++k)
        left.set_weight(static_cast<Index>(k), places.weights[k]);
    for (Index k = 0; k < count; ++k)
        for (Index c = places.starts[k]; c < places.starts[k + 1]; ++c) left.couple(k, places.coupled[c]);

    constexpr Index eliminated = std::numeric_limits<Index>::max();
    std::vector<Index> degree(count), order;
    for (Index k = 0; k < count; ++k) degree[k] = left.degree(k);
    order.reserve(count);
    for (Index step = 0; step < count; ++step) {
        const Index pivot =
            static_cast<Index>(std::min_element(degree.begin(), degree.end()) - degree.begin());
        degree[pivot] = eliminated;
        order.push_back(places.nodes[pivot]);
        left.eliminate(pivot, [&](Index row) { degree[row] = left.degree(row); });
    }
    return order;
}

Places positions_of(const NodeGraph& graph, const std::vector<Index>& nodes,
                    const std::vector<Index>& piece_of, std::vector<Index>& number) {
    const Index own = piece_of[nodes.front()];
    Places places{nodes, {0}, {}, {}};
    std::vector<Index> beyond;
    for (const Index node : nodes) {
        number[node] = static_cast<Index>(places.weights.size());
        places.weights.push_back(graph.weights[node]);
        for (const Index other : graph.around(node))
            if (piece_of[other] != own) beyond.push_back(other);
    }
    std::sort(beyond.begin(), beyond.end());
    beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
    for (const Index node : beyond) places.weights.push_back(graph.weights[node]);
    for (const Index node : nodes) {
        for (const Index other : graph.around(node)) {
            if (piece_of[other] == own) {
                places.coupled.push_back(number[other]);
            } else {
                const auto at = std::lower_bound(beyond.begin(), beyond.end(), other) - beyond.begin();
                places.coupled.push_back(static_cast<Index>(nodes.size() + at));
            }
        }
        places.starts.push_back(static_cast<Index>(places.coupled.size()));
    }
    return places;
}

}  // namespace

std::vector<Index> minimum_degree_order(const NodeGraph& graph, const std::vector<Index>& nodes,
                                        const std::vector<Index>& piece_of, std::vector<Index>& number) {
    if (nodes.empty()) return {};
    const Places places = positions_of(graph, nodes, piece_of, number);
    const std::size_t count = places.weights.size();
    if (count <= 4 * bits) return ordered<4>(places);
    if (count <= 6 * bits) return ordered<6>(places);
    if (count <= 8 * bits) return ordered<8>(places);
    if (count <= 16 * bits) return ordered<16>(places);
    if (count <= 64 * bits) return ordered<64>(places);
    return nodes;
}

}  // namespace magshell
