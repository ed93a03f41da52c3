// A loop over blocks of work on a few threads.
//
// Results must not depend on the number of threads: callers hand in blocks that write to disjoint places, and
// decide the order of additions themselves. The pool is our own rather than OpenMP's, so that a fork
// (Python's multiprocessing) does not leave a child waiting for threads it does not have, and so that
// ThreadSanitizer can see it.
#pragma once

#include <functional>

namespace magshell {

/// How many threads a parallel loop uses, the caller's included. At least 1.
int num_threads();
void set_num_threads(int count);

/// Calls body(i) for every i in [0, count), each exactly once, in any order and on any thread. The first
/// exception thrown is rethrown in the caller, after the loop has ended.
void parallel_for(int count, const std::function<void(int)>& body);

}  // namespace magshell
