#include "magshell/contact/continuous.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace magshell {
namespace {

// [-] largest number of directions tried; the fraction found so far is safe anyway. Fixed by
// test_gap_is_kept_along_the_path_up_to_the_bound
constexpr int most_turns = 1024;
// [-] fraction of the usable gap that may be left unused; fixed by
// test_hard_pairs_that_close_stop_before_they_touch
constexpr double small_rest = 0.01;
// Relative round-off of a projected difference of positions. [-] A position x + t p has an error of two units
// of round-off, a difference of two such positions five, and its product with a unit direction (itself accurate
// to four) less than 32. Fixed by test_bound_far_from_the_origin_is_smaller_but_never_too_large.
constexpr double projection_round_off = 32.0 * std::numeric_limits<double>::epsilon();

/// Returns the number of nodes of a pair's first part.
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
    const double error =
        projection_round_off * (largest_coordinate(kind, from) + largest_coordinate(kind, to));
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
        // Additional fraction until a corner of one part comes too close to a corner of the other.
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
