// Approximate minimum degree. What elimination has left of a graph is stored as variables and elements
// (quotient graph). An element is the result of an elimination: variables that are all coupled with each other,
// without storing their pairs. A variable knows the elements that contain it, and those adjacent variables that
// share no element with it. Variables with the same adjacency are merged into one, whose weight is the sum of
// theirs.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "magshell/linalg/ordering/ordering.h"

namespace magshell {
namespace {

constexpr Index none = -1;  // no variable; plain-words: ok

// Buckets of variables by their degree, to find one of least degree.
class ByDegree {
  public:
    ByDegree(Index nodes, Index largest)
        : first_(largest + 1, none), next_(nodes, none), before_(nodes, none), degree_(nodes, 0) {}

    Index degree(Index node) const { return degree_[node]; }

    void insert(Index node, Index degree) {
        degree_[node] = degree;
        next_[node] = first_[degree];
        before_[node] = none;
        if (first_[degree] != none) before_[first_[degree]] = node;
        first_[degree] = node;
        least_ = std::min(least_, degree);
    }

    void remove(Index node) {
        if (next_[node] != none) before_[next_[node]] = before_[node];
        (before_[node] == none ? first_[degree_[node]] : next_[before_[node]]) = next_[node];
    }

    Index least() {
        while (first_[least_] == none) ++least_;
        return first_[least_];
    }

  private:
    std::vector<Index> first_, next_, before_, degree_;
    Index least_ = 0;
};

Index total(const std::vector<Index>& weights) {
    Index sum = 0;
    for (const Index weight : weights) sum += weight;
    return sum;
}

class Elimination {
  public:
    explicit Elimination(const NodeGraph& graph)
        : lists_(graph.neighbours),
          begin_(graph.starts.begin(), graph.starts.end() - 1),
          elements_(graph.size(), 0),
          variables_(graph.size(), 0),
          weight_(graph.weights),
          state_(graph.size(), State::variable),
          members_of_(graph.size()),
          within_(graph.size(), 0),
          next_(graph.size(), none),
          last_(graph.size()),
          met_(graph.size(), 0),
          beyond_(graph.size(), 0),
          bound_(graph.size(), 0),
          mark_(graph.size(), 0),
          left_(total(graph.weights)),
          by_degree_(graph.size(), left_) {
        for (Index i = 0; i < graph.size(); ++i) {
            variables_[i] = graph.starts[i + 1] - graph.starts[i];
            last_[i] = i;
        }
        put_aside_what_knows_many(graph);
        for (Index i = 0; i < graph.size(); ++i)
            if (state_[i] == State::variable) by_degree_.insert(i, degree(graph, i));
    }

    std::vector<Index> order(const std::function<void()>& watch) {
        constexpr int now_and_then = 1024;  // [eliminations] between calls of watch; plain-words: ok
        for (int step = 0; left_ > 0; ++step) {
            if (step % now_and_then == 0) watch();
            eliminate(by_degree_.least());
        }
        order_.insert(order_.end(), aside_.begin(), aside_.end());
        return std::move(order_);
    }

  private:
    enum class State : char { variable, element, gone };

    Index degree(const NodeGraph& graph, Index node) const {
        Index sum = 0;
        for (const Index other : graph.around(node))
            if (state_[other] == State::variable) sum += weight_[other];
        return sum;
    }

    // Orders nodes with very many neighbours last: they would be in every list.
    void put_aside_what_knows_many(const NodeGraph& graph) {
        // [-] Factor of the square root of all unknowns, and least number, of neighbours that count as very many, as in AMD;
        // fixed by test_minimum_degree_puts_the_dense_row_of_an_arrow_last
        constexpr double dense_factor = 10.0, least_dense = 16.0;
        const double many = std::max(least_dense, dense_factor * std::sqrt(static_cast<double>(left_)));
        for (Index i = 0; i < graph.size(); ++i)
            if (degree(graph, i) > many) aside_.push_back(i);
        for (const Index i : aside_) {
            state_[i] = State::gone;
            left_ -= weight_[i];
        }
    }

    void eliminate(Index pivot) {
        ++step_;
        by_degree_.remove(pivot);
        gather(pivot);
        std::vector<Index>& members = members_of_[pivot];
        for (const Index i : members)
            for (Index k = begin_[i]; k < begin_[i] + elements_[i]; ++k) count_beyond(lists_[k], weight_[i]);
        Index taken = weight_[pivot];
        keys_.clear();
        for (const Index i : members) {
            const Index weight = weight_[i];
            if (forget_what_the_pivot_knows(i, pivot)) continue;
            taken += weight;  // the variable is coupled with nothing else
            make_part_of(i, pivot);
        }
        join_alike();
        std::erase_if(members, [&](Index i) { return state_[i] != State::variable; });
        left_ -= taken;
        within_[pivot] = 0;
        for (const Index i : members) within_[pivot] += weight_[i];
        for (const Index i : members)
            by_degree_.insert(i, std::min(bound_[i] + within_[pivot], left_) - weight_[i]);
        for (Index node = pivot; node != none; node = next_[node]) order_.push_back(node);
    }

    // Turns a variable into an element that contains everything it is coupled with.
    void gather(Index pivot) {
        std::vector<Index> members;
        met_[pivot] = step_;
        const auto take = [&](Index i) {
            if (state_[i] != State::variable || met_[i] == step_) return;
            met_[i] = step_;
            members.push_back(i);
            by_degree_.remove(i);
        };
        const Index end = begin_[pivot] + elements_[pivot];
        for (Index k = begin_[pivot]; k < end; ++k) {
            if (state_[lists_[k]] != State::element) continue;
            for (const Index i : members_of_[lists_[k]]) take(i);
            absorb(lists_[k]);
        }
        for (Index k = end; k < end + variables_[pivot]; ++k) take(lists_[k]);
        members_of_[pivot] = std::move(members);
        state_[pivot] = State::element;
    }

    void absorb(Index element) {
        state_[element] = State::gone;
        std::vector<Index>().swap(members_of_[element]);
    }

    // Counts the weight of an element outside the pivot's element, by subtracting all common variables.
    void count_beyond(Index element, Index weight) {
        if (state_[element] != State::element) return;
        if (met_[element] != step_) {
            met_[element] = step_;
            beyond_[element] = within_[element];
        }
        beyond_[element] -= weight;
    }

    // Replaces, in a variable's lists, everything that the pivot's element contains by that element. Returns
    // false if nothing else is left.
    bool forget_what_the_pivot_knows(Index i, Index pivot) {
        Index outside = 0, to = begin_[i];
        std::uint64_t key = 0;
        Index from = begin_[i];
        for (const Index end = from + elements_[i]; from < end; ++from) {
            const Index element = lists_[from];
            if (state_[element] != State::element) continue;
            if (beyond_[element] == 0) {
                absorb(element);
                continue;
            }
            outside += beyond_[element];
            key += static_cast<std::uint64_t>(element);
            lists_[to++] = element;
        }
        const Index kept = to - begin_[i];
        for (const Index end = from + variables_[i]; from < end; ++from) {
            const Index other = lists_[from];
            if (state_[other] != State::variable || met_[other] == step_) continue;
            outside += weight_[other];
            key += static_cast<std::uint64_t>(other);
            lists_[to++] = other;
        }
        if (outside == 0) return false;
        // There is space: the pivot, or an absorbed element, was in the list.
        const Index beside = to - begin_[i] - kept;
        lists_[to] = lists_[begin_[i] + kept];
        lists_[begin_[i] + kept] = lists_[begin_[i]];
        lists_[begin_[i]] = pivot;
        elements_[i] = kept + 1;
        variables_[i] = beside;
        bound_[i] = std::min(by_degree_.degree(i), outside);
        keys_.push_back({key, i});
        return true;
    }

    void make_part_of(Index i, Index whole) {
        state_[i] = State::gone;
        weight_[i] = 0;
        next_[last_[whole]] = i;
        last_[whole] = last_[i];
    }

    void join_alike() {
        std::sort(keys_.begin(), keys_.end());
        for (std::size_t a = 0; a < keys_.size(); ++a) {
            const Index i = keys_[a].second;
            if (state_[i] != State::variable || a + 1 == keys_.size() || keys_[a + 1].first != keys_[a].first)
                continue;
            ++marks_;
            const Index length = elements_[i] + variables_[i];
            for (Index k = begin_[i]; k < begin_[i] + length; ++k) mark_[lists_[k]] = marks_;
            for (std::size_t b = a + 1; b < keys_.size() && keys_[b].first == keys_[a].first; ++b) {
                const Index j = keys_[b].second;
                if (state_[j] != State::variable || elements_[j] != elements_[i] ||
                    variables_[j] != variables_[i])
                    continue;
                const auto own = lists_.begin() + begin_[j];
                if (!std::all_of(own, own + length, [&](Index other) { return mark_[other] == marks_; }))
                    continue;
                weight_[i] += weight_[j];
                make_part_of(j, i);
            }
        }
    }

    // adjacency of each variable: elements, then variables
    std::vector<Index> lists_, begin_, elements_, variables_;
    std::vector<Index> weight_;  // of each variable, in degrees of freedom
    std::vector<State> state_;
    std::vector<std::vector<Index>> members_of_;  // of each element
    std::vector<Index> within_;                   // weight of these
    std::vector<Index> next_, last_;              // variables merged into each variable, as a linked list
    std::vector<Index> met_, beyond_, bound_, mark_;
    std::vector<std::pair<std::uint64_t, Index>> keys_;
    std::vector<Index> aside_, order_;
    Index left_, step_ = 0, marks_ = 0;
    ByDegree by_degree_;
};

}  // namespace

std::vector<Index> approximate_minimum_degree(const NodeGraph& graph, const std::function<void()>& watch) {
    return Elimination(graph).order(watch);
}

}  // namespace magshell
