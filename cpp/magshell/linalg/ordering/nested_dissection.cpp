#include <algorithm>

#include "magshell/core/parallel.h"
#include "magshell/linalg/ordering/bisection.h"
#include "magshell/linalg/ordering/ordering.h"

namespace magshell {
namespace {

// A separator, or a part that is not cut further, and the separator above it.
struct Piece {
    Index parent;  // index of the separator above, which is lower; -1 for the first
    std::vector<Index> nodes;
};

struct Halves {
    std::vector<Index> separator, left, right;
};

Halves cut(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state) {
    Halves halves;
    halves.separator = bisect(graph, nodes, state);
    for (const Index node : nodes) {
        if (state.side[node] == Side::between) continue;
        (state.side[node] == Side::left ? halves.left : halves.right).push_back(node);
        state.side[node] = Side::left;
    }
    for (const Index node : halves.separator) state.side[node] = Side::settled;
    return halves;
}

// Returns the tree of separators of a graph; parents come before their children.
std::vector<Piece> dissect(const NodeGraph& graph, std::size_t few, const std::function<void()>& watch) {
    CutState state(graph);
    std::vector<Piece> pieces(1, Piece{-1, std::vector<Index>(graph.size())});
    for (Index node = 0; node < graph.size(); ++node) pieces[0].nodes[node] = node;
    for (std::size_t begin = 0; begin < pieces.size();) {
        watch();
        const std::size_t end = pieces.size();
        std::vector<Halves> halves(end - begin);
        parallel_for(static_cast<int>(end - begin), [&](int k) {
            const std::vector<Index>& nodes = pieces[begin + k].nodes;
            if (nodes.size() > few) halves[k] = cut(graph, nodes, state);
        });
        for (std::size_t k = begin; k < end; ++k) {
            Halves& each = halves[k - begin];
            if (each.left.empty() || each.right.empty()) continue;
            pieces[k].nodes = std::move(each.separator);
            for (std::vector<Index>* half : {&each.left, &each.right})
                pieces.push_back({static_cast<Index>(k), std::move(*half)});
        }
        begin = end;
    }
    return pieces;
}

Index common_ancestor(const std::vector<Piece>& pieces, Index a, Index b) {
    while (a != b) (a > b ? a : b) = pieces[std::max(a, b)].parent;
    return a;
}

// Returns the piece that a node can go to, as far from the root as the adjacent leaders allow: the piece that
// all of them have on their path to the root, or where their paths part.
Index place_beside(const std::vector<Piece>& pieces, const NodeGraph& graph, Index node,
                   const std::vector<char>& leads, const std::vector<Index>& piece_of) {
    Index place = -1;
    bool parted = false;
    for (const Index other : graph.around(node)) {
        if (!leads[other]) continue;
        const Index piece = piece_of[other];
        const Index common = place < 0 ? -1 : common_ancestor(pieces, place, piece);
        if (common == place) {
            if (!parted) place = piece;
        } else if (common != piece) {
            place = common;
            parted = true;
        }
    }
    return place;
}

// Assigns the nodes that are not leaders to pieces next to those: completes piece_of and the pieces' nodes.
void place_followers(const NodeGraph& graph, const std::vector<char>& leads, std::vector<Piece>& pieces,
                     std::vector<Index>& piece_of) {
    std::vector<Index> followers;
    for (Index node = 0; node < graph.size(); ++node) {
        if (leads[node]) continue;
        followers.push_back(node);
        piece_of[node] = place_beside(pieces, graph, node, leads, piece_of);
    }
    // Few of them are adjacent across a separator: one of the two joins it.
    for (bool moved = true; moved;) {
        moved = false;
        for (const Index node : followers) {
            for (const Index other : graph.around(node)) {
                const Index common = common_ancestor(pieces, piece_of[node], piece_of[other]);
                if (common == piece_of[node] || common == piece_of[other]) continue;
                piece_of[node] = common;
                moved = true;
            }
        }
    }
    for (const Index node : followers) pieces[piece_of[node]].nodes.push_back(node);
}

}  // namespace

std::vector<Index> nested_dissection(const NodeGraph& graph, const std::function<void()>& watch) {
    if (graph.size() == 0) return {};
    // [nodes] size of a part that is not cut further; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr std::size_t few_nodes = 200;
    const std::vector<char> leads = leaders(graph);
    std::vector<Index> leading, number(graph.size(), -1);
    for (Index node = 0; node < graph.size(); ++node) {
        if (!leads[node]) continue;
        number[node] = static_cast<Index>(leading.size());
        leading.push_back(node);
    }
    const std::size_t few = few_nodes * leading.size() / static_cast<std::size_t>(graph.size());
    std::vector<Piece> pieces = dissect(induced(graph, leading, number), few, watch);
    std::vector<Index> piece_of(graph.size(), -1);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
        for (Index& node : pieces[k].nodes) {
            node = leading[node];
            piece_of[node] = static_cast<Index>(k);
        }
    }
    place_followers(graph, leads, pieces, piece_of);
    watch();

    std::vector<char> is_cut(pieces.size(), false);
    for (const Piece& piece : pieces)
        if (piece.parent >= 0) is_cut[piece.parent] = true;
    parallel_for(static_cast<int>(pieces.size()), [&](int k) {
        if (!is_cut[k]) pieces[k].nodes = minimum_degree_order(graph, pieces[k].nodes, piece_of, number);
    });
    std::vector<Index> order;
    order.reserve(graph.size());
    for (auto piece = pieces.rbegin(); piece != pieces.rend(); ++piece)
        order.insert(order.end(), piece->nodes.begin(), piece->nodes.end());
    return order;
}

}  // namespace magshell
