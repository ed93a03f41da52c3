#include "magshell/contact/continuous.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace magshell {
namespace {

constexpr int most_turns = 1024;     // of the direction: the share found up to there is free all the same
constexpr double small_rest = 0.01;  // of the gap to be used up: nearer than that is near enough
// Of the largest coordinate. A place x + t p has an error of two units of round-off, a difference of two such places
// five, and its product with a direction of length 1 (itself good to four) less than 32.
constexpr double round_off = 32.0 * std::numeric_limits<double>::epsilon();

/// How many of a pair's nodes are of the first part.
int first_part(PairKind kind) {
    return kind == PairKind::edge_edge ? 2 : 1;
}

double largest_coordinate(PairKind kind, const PairPositions& x) {
    double largest = 0.0;
    for (int i = 0; i < nodes_of(kind); ++i) largest = std::max(largest, x[i].lpNorm<Eigen::Infinity>());
    return largest;
}

}  // namespace

double collision_free_step(PairKind kind, const PairPositions& from, const PairPositions& to,
                           double thickness, double keep) {
    const int count = nodes_of(kind), first = first_part(kind);
    const double error = round_off * (largest_coordinate(kind, from) + largest_coordinate(kind, to));
    PairPositions way = to;
    for (int i = 0; i < count; ++i) way[i] = to[i] - from[i];
    PairPositions x = from;
    double share = 0.0, least = 0.0, enough = 0.0;
    for (int turn = 0; turn < most_turns; ++turn) {
        const Proximity near = proximity(kind, x);
        const double gap = near.distance - thickness;
        if (turn == 0) {
            if (!(gap > error)) return 0.0;
            least = keep * gap;
            enough = least + small_rest * (gap - least);
        }
        if (gap <= enough) return share;
        // How much farther, until some corner of the one part is too near to some of the other.
        double more = 1.0 - share;
        for (int i = 0; i < first; ++i)
            for (int j = first; j < count; ++j) {
                const double nearer = near.normal.dot(way[j] - way[i]) + error;
                if (nearer <= error) continue;
                const double left = near.normal.dot(x[i] - x[j]) - thickness - least - error;
                more = std::min(more, std::max(left, 0.0) / nearer);
            }
        if (!(more > 0.0)) return share;
        if (more >= 1.0 - share) return 1.0;
        share += more;
        for (int i = 0; i < count; ++i) x[i] = from[i] + share * way[i];
    }
    return share;
}

}  // namespace magshell
