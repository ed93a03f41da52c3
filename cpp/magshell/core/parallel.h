// A loop over blocks of work on a few threads.
//
// Results must not depend on the number of threads: callers hand in blocks that write to disjoint places, and
// decide the order of additions themselves. The pool is our own rather than OpenMP's, so that a fork
// (Python's multiprocessing) does not leave a child waiting for threads it does not have, and so that
// ThreadSanitizer can see it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

namespace magshell {

/// How many threads a parallel loop may use, the caller's included. At least 1.
int num_threads();
void set_num_threads(int count);

/// How long a part of a loop took when it last ran, by which it is decided whether the next is worth waking others.
using PartTime = std::atomic<std::int64_t>;  // ns

void parallel_for(int count, const std::function<void(int)>& body, PartTime& part_time);

/// Calls body(i) for every i in [0, count), each exactly once, in any order and on any thread. The first
/// exception thrown is rethrown in the caller, after the loop has ended.
template <class Body>
void parallel_for(int count, const Body& body) {
    static PartTime part_time{0};  // of this place in the source
    parallel_for(count, std::function<void(int)>(std::ref(body)), part_time);
}

}  // namespace magshell
