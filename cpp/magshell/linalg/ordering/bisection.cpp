#include "magshell/linalg/ordering/bisection.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/linalg/ordering/cuts.h"

namespace magshell {
namespace {

// Returns the cut at the median coordinate. `reach` bounds how much the coordinates of neighbours differ, so
// that only nodes near the cut need a closer look.
template <class Coordinate, class Reach>
Cut median_cut(const NodeGraph& graph, const std::vector<Index>& nodes, const CutState& state,
               const Coordinate& coordinate, const Reach& reach) {
    std::vector<double> values;
    values.reserve(nodes.size());
    for (const Index node : nodes) values.push_back(coordinate(node));
    std::vector<double> sorted = values;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    Cut cut;
    cut.at = *middle;
    if (std::none_of(sorted.begin(), middle, [&](double value) { return value < cut.at; })) {
        // More than half of the nodes have the smallest coordinate.
        const auto above =
            std::remove_if(sorted.begin(), sorted.end(), [&](double v) { return v <= cut.at; });
        if (above == sorted.begin()) return {};
        cut.at = *std::min_element(sorted.begin(), above);
    }
    Index borders[2] = {0, 0};
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (std::abs(values[k] - cut.at) > reach(nodes[k])) continue;
        const bool left = values[k] < cut.at;
        for (const Index beside : graph.around(nodes[k])) {
            if (state.side[beside] == Side::settled || (coordinate(beside) < cut.at) == left) continue;
            borders[left] += graph.weights[nodes[k]];
            break;
        }
    }
    cut.left_border = borders[1] <= borders[0];
    cut.weight = std::min(borders[0], borders[1]);
    return cut;
}

// Returns unit vectors along which the points extend far enough for a cut perpendicular to them to be short.
std::vector<Vec3> directions(const std::vector<Vec3>& points, const std::vector<Index>& nodes) {
    Vec3 center = Vec3::Zero();
    for (const Index node : nodes) center += points[node];
    center /= static_cast<double>(nodes.size());
    Mat3 moments = Mat3::Zero();
    for (const Index node : nodes) {
        const Vec3 arm = points[node] - center;
        moments += arm * arm.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Mat3> solver;
    solver.computeDirect(moments);
    const Mat3 axes = solver.eigenvectors();
    // [-] smallest second moment along a direction, relative to the mean; fixed by
    // test_dissection_of_a_solid_needs_less_than_metis
    constexpr double far_enough = 0.1;
    // [-] cosine of equal directions; test_dissection_of_a_solid_needs_less_than_metis
    constexpr double alike = 0.99;
    const double enough = far_enough * moments.trace() / 3.0;
    std::vector<Vec3> chosen;
    const auto consider = [&](const Vec3& direction) {
        if (!(direction.dot(moments * direction) > enough)) return;
        if (std::none_of(chosen.begin(), chosen.end(),
                         [&](const Vec3& other) { return std::abs(other.dot(direction)) > alike; }))
            chosen.push_back(direction);
    };
    for (int k = 2; k >= 0; --k) consider(axes.col(k));
    for (int k = 0; k < 3; ++k) consider(Vec3::Unit(k));
    for (const double sign : {1.0, -1.0}) consider((axes.col(2) + sign * axes.col(1)).normalized());
    return chosen;
}

// Computes the level of each node: its distance in edges from a node at an end of its connected set. The levels
// of different connected sets follow one another.
void find_levels(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state) {
    std::vector<Index> reached;  // nodes of this connected set
    const auto search = [&](Index from, Index first_level) {
        reached.assign(1, from);
        state.level[from] = first_level;
        for (std::size_t k = 0; k < reached.size(); ++k) {
            const Index next_level = state.level[reached[k]] + 1;
            for (const Index beside : graph.around(reached[k])) {
                if (state.side[beside] == Side::settled || state.level[beside] >= 0) continue;
                state.level[beside] = next_level;
                reached.push_back(beside);
            }
        }
    };
    for (const Index node : nodes) state.level[node] = -1;
    Index first_level = 0;
    for (const Index node : nodes) {
        if (state.level[node] >= 0) continue;
        search(node, first_level);
        const Index end = reached.back();
        for (const Index each : reached) state.level[each] = -1;
        search(end, first_level);
        first_level = state.level[reached.back()] + 2;
    }
}

// A candidate cut: perpendicular to a direction, or by levels if the direction is zero.
struct Way {
    Cut cut;
    Vec3 direction;
};

// Returns true if more cuts than the best looking one are worth trying: if eliminating the separator takes long
// compared with making a cut.
bool worth_trying(Index separator, std::size_t nodes) {
    // [unknowns cubed per node] elimination time that a cut is worth; fixed by
    // test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr double as_long = 2e4;
    return std::pow(static_cast<double>(separator), 3) > as_long * static_cast<double>(nodes);
}

bool lighter(const Way& a, const Way& b) {
    return a.cut.weight < b.cut.weight;
}

bool cheaper(const Way& a, const Way& b) {
    return a.cut.cost < b.cut.cost;
}

// Assigns the nodes, all of them on the left, to the sides of a cut along state.coordinate, and returns the
// lighter border as the separator.
std::vector<Index> separate(const NodeGraph& graph, const std::vector<Index>& nodes, const Cut& cut,
                            CutState& state) {
    for (const Index node : nodes)
        if (!(state.coordinate[node] < cut.at)) state.side[node] = Side::right;
    const Side thinned = cut.left_border ? Side::left : Side::right;
    std::vector<Index> separator;
    for (const Index node : nodes) {
        if (state.side[node] != thinned) continue;
        const std::span<const Index> around = graph.around(node);
        if (std::any_of(around.begin(), around.end(),
                        [&](Index beside) { return state.side[beside] == other(thinned); }))
            separator.push_back(node);
    }
    for (const Index node : separator) state.side[node] = Side::between;
    return separator;
}

// Returns the cost of the current separator, in the units of Cut::cost.
double cost_of(const NodeGraph& graph, const std::vector<Index>& nodes, const CutState& state) {
    double weight[4] = {0.0, 0.0, 0.0, 0.0};
    for (const Index node : nodes) weight[static_cast<int>(state.side[node])] += graph.weights[node];
    const double sides = weight[0] + weight[1];
    return cost_of_cut(weight[2], std::abs(weight[0] - 0.5 * sides) / sides);
}

}  // namespace

CutState::CutState(const NodeGraph& graph)
    : side(graph.size(), Side::left),
      level(graph.size()),
      coordinate(graph.size()),
      place(graph.size()),
      beside(graph.size()),
      has_moved(graph.size(), false) {
    if (graph.points.empty()) return;
    // [-] Enlargement for round-off; fixed by test_degenerate_points_give_a_valid_ordering
    constexpr double for_rounding = 1.0 + 1e-9;
    reach.assign(graph.size(), 0.0);
    for (Index node = 0; node < graph.size(); ++node) {
        for (const Index beside_it : graph.around(node))
            reach[node] = std::max(reach[node], (graph.points[beside_it] - graph.points[node]).squaredNorm());
        reach[node] = std::sqrt(reach[node]) * for_rounding;  // enlarged for round-off
    }
}

std::vector<Index> bisect(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state) {
    find_levels(graph, nodes, state);
    std::vector<Way> ways;
    const auto level = [&](Index node) { return static_cast<double>(state.level[node]); };
    ways.push_back({median_cut(graph, nodes, state, level, [](Index) { return 1.0; }), Vec3::Zero()});
    if (!graph.points.empty()) {
        for (const Vec3& direction : directions(graph.points, nodes)) {
            const auto along = [&](Index node) { return direction.dot(graph.points[node]); };
            const auto reach = [&](Index node) { return state.reach[node]; };
            ways.push_back({median_cut(graph, nodes, state, along, reach), direction});
        }
    }
    const auto is_none = [](const Way& way) { return way.cut.weight == std::numeric_limits<Index>::max(); };
    std::erase_if(ways, is_none);
    if (ways.empty()) return {};
    const auto set_coordinates = [&](const Vec3& direction) {
        const bool by_level = direction.isZero(0.0);
        for (const Index node : nodes)
            state.coordinate[node] = by_level ? level(node) : direction.dot(graph.points[node]);
    };
    if (const auto first = std::min_element(ways.begin(), ways.end(), lighter);
        worth_trying(first->cut.weight, nodes.size())) {
        for (Way& way : ways) {
            set_coordinates(way.direction);
            way.cut = lightest_cut(graph, nodes, state);
        }
        std::stable_sort(ways.begin(), ways.end(), cheaper);
        std::erase_if(ways, is_none);
    } else {
        ways = {*first};
    }
    // Cuts that look best before refinement are smoother, and so are the parts that they leave: a later
    // candidate must be clearly cheaper.
    // [-] Largest cost of such a candidate relative to the best so far; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr double so_much_less = 0.9;
    std::vector<Side> best_sides;
    std::vector<Index> best_separator;
    double least = std::numeric_limits<double>::max();
    for (const Way& way : ways) {
        set_coordinates(way.direction);
        std::vector<Index> separator = separate(graph, nodes, way.cut, state);
        refine_separator(graph, nodes, separator, state);
        if (ways.size() == 1) return separator;
        const double cost = cost_of(graph, nodes, state);
        if (best_sides.empty() || cost < so_much_less * least) {
            least = cost;
            best_separator = std::move(separator);
            best_sides.clear();
            for (const Index node : nodes) best_sides.push_back(state.side[node]);
        }
        for (const Index node : nodes) state.side[node] = Side::left;
    }
    for (std::size_t k = 0; k < best_sides.size(); ++k) state.side[nodes[k]] = best_sides[k];
    return best_separator;
}

}  // namespace magshell
