#include <algorithm>
#include <queue>
#include <utility>

#include "magshell/linalg/ordering/bisection.h"

namespace magshell {
namespace {

// [-] largest fraction of the whole weight on one side; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
constexpr double largest_share = 0.6;
// [-] fraction of the larger side of both up to which the sides count as balanced; same
// test_best_ordering_needs_few_operations_beside_amd_and_metis
constexpr double alike_enough = 0.52;
constexpr int most_passes = 3;  // [-] fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
// [moves] without improvement before a pass ends, at most the separator's nodes; fixed by
// test_best_ordering_needs_few_operations_beside_amd_and_metis
constexpr int most_moves_in_vain = 200;

int number(Side side) {
    return static_cast<int>(side);
}

class Refinement {
  public:
    Refinement(const NodeGraph& graph, const std::vector<Index>& nodes, std::vector<Index>& separator,
               CutState& state)
        : graph_(graph), separator_(separator), state_(state) {
        for (const Index node : nodes) weight_[number(state.side[node])] += graph.weights[node];
        const double whole = static_cast<double>(weight_[0]) + weight_[1] + weight_[2];
        largest_ = std::max({static_cast<Index>(largest_share * whole), weight_[0], weight_[1]});
    }

    void run() {
        for (int pass = 0; pass < most_passes && improved_in_a_pass(); ++pass) {
        }
    }

  private:
    // Returns the cost, to be minimized: the separator's weight, then the imbalance of the sides. Sides that
    // are balanced enough are not balanced further: it would make the separator jagged, and later cuts along it
    // longer.
    std::pair<Index, Index> cost() const {
        const Index larger = std::max(weight_[0], weight_[1]);
        return {weight_[2], larger > alike_enough * (weight_[0] + weight_[1]) ? larger : 0};
    }

    struct Move {
        Index gain, node;
        friend bool operator<(const Move& a, const Move& b) {
            return std::pair(a.gain, b.node) < std::pair(b.gain, a.node);
        }
    };

    // Returns how much lighter the separator becomes if one of its nodes goes to a side.
    Index gain(Index node, Side to) const {
        return graph_.weights[node] - state_.beside[node][number(other(to))];
    }
    void offer(Index node, Side to) { moves_[number(to)].push({gain(node, to), node}); }
    void enter(Index node) {
        std::array<Index, 2>& beside = state_.beside[node];
        beside = {0, 0};
        for (const Index each : graph_.around(node))
            if (state_.side[each] == Side::left || state_.side[each] == Side::right)
                beside[number(state_.side[each])] += graph_.weights[each];
        for (const Side to : {Side::left, Side::right}) offer(node, to);
    }

    // Returns the best move to a side that is still valid.
    const Move* best(Side to) {
        std::priority_queue<Move>& moves = moves_[number(to)];
        for (; !moves.empty(); moves.pop()) {
            const Move& move = moves.top();
            if (state_.side[move.node] != Side::between || state_.has_moved[move.node]) continue;
            if (gain(move.node, to) != move.gain) continue;
            const Index after = weight_[number(to)] + graph_.weights[move.node];
            if (after <= largest_ || weight_[number(to)] < weight_[number(other(to))]) return &move;
            return nullptr;
        }
        return nullptr;
    }
    bool improved_in_a_pass();
    void change_side(Index node, Side to) {
        weight_[number(state_.side[node])] -= graph_.weights[node];
        weight_[number(to)] += graph_.weights[node];
        state_.side[node] = to;
    }
    void apply(Index node, Side to);

    const NodeGraph& graph_;
    std::vector<Index>& separator_;  // while nodes move it also contains those that have left it
    CutState& state_;
    Index weight_[3] = {0, 0, 0};
    Index largest_;
    std::priority_queue<Move> moves_[2];
    std::vector<std::pair<Index, Side>> log_;  // nodes and their previous sides
};

// Moves a node from the separator to a side, and its neighbours on the other side into the separator.
void Refinement::apply(Index node, Side to) {
    log_.emplace_back(node, Side::between);
    change_side(node, to);
    state_.has_moved[node] = true;
    const Side across = other(to);
    for (const Index beside : graph_.around(node)) {
        if (state_.side[beside] == Side::between) {
            state_.beside[beside][number(to)] += graph_.weights[node];
            offer(beside, across);
        } else if (state_.side[beside] == across) {
            log_.emplace_back(beside, across);
            change_side(beside, Side::between);
            separator_.push_back(beside);
            enter(beside);
            for (const Index each : graph_.around(beside)) {
                if (state_.side[each] != Side::between) continue;
                state_.beside[each][number(across)] -= graph_.weights[beside];
                offer(each, to);
            }
        }
    }
}

bool Refinement::improved_in_a_pass() {
    for (std::priority_queue<Move>& moves : moves_) moves = {};
    for (const Index node : separator_) enter(node);
    log_.clear();
    const auto before = cost();
    auto least = before;
    std::size_t kept = 0;  // entries of the log to keep
    const int patience = std::min(most_moves_in_vain, static_cast<int>(separator_.size()));
    for (int in_vain = 0; in_vain < patience; ++in_vain) {
        const Move *left = best(Side::left), *right = best(Side::right);
        if (!left && !right) break;
        const bool to_left =
            !right ||
            (left && (left->gain > right->gain || (left->gain == right->gain && weight_[0] <= weight_[1])));
        apply((to_left ? left : right)->node, to_left ? Side::left : Side::right);
        if (cost() >= least) continue;
        least = cost();
        kept = log_.size();
        in_vain = 0;
    }
    for (const auto& [node, side] : log_) state_.has_moved[node] = false;
    while (log_.size() > kept) {
        change_side(log_.back().first, log_.back().second);
        log_.pop_back();
    }
    std::erase_if(separator_, [&](Index node) { return state_.side[node] != Side::between; });
    std::sort(separator_.begin(), separator_.end());  // a node that left and came back is listed twice
    separator_.erase(std::unique(separator_.begin(), separator_.end()), separator_.end());
    return least < before;
}

}  // namespace

void refine_separator(const NodeGraph& graph, const std::vector<Index>& nodes, std::vector<Index>& separator,
                      CutState& state) {
    Refinement(graph, nodes, separator, state).run();
}

}  // namespace magshell
