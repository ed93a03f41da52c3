// Parallel loops on a few threads.
//
// Results must not depend on the number of threads: the caller provides iterations that write to disjoint memory, and determines the order
// of additions itself. The thread pool is our own instead of OpenMP's, so that a forked process (Python's multiprocessing) does not
// wait for threads that it does not have, and so that ThreadSanitizer can check it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

namespace magshell {

/// Returns how many threads a parallel loop may use, including the caller; at least 1.
int num_threads();
void set_num_threads(int count);

/// The duration of a part of a loop in its last run [ns]; it decides whether waking helpers is worth while in the next run.
using PartTime = std::atomic<std::int64_t>;  // [ns]

void parallel_for(int count, const std::function<void(int)>& body, PartTime& part_time);

/// Calls body(i) for every i in [0, count), each exactly once, in any order and on any thread. The first exception is rethrown in the
/// caller after the loop has ended.
template <class Body>
void parallel_for(int count, const Body& body) {
    static PartTime part_time{0};  // one per call site
    parallel_for(count, std::function<void(int)>(std::ref(body)), part_time);
}

}  // namespace magshell
