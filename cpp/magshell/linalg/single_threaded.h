// Keeps the threads of other libraries out of a calculation.
#pragma once

#include <string>

namespace magshell {

/// While it lives, OpenMP regions entered by this thread and calls of the BLAS run on one thread.
///
/// CHOLMOD as Debian ships it asks for four OpenMP threads whatever OMP_NUM_THREADS says, which makes it 1.5
/// to 3.5 times slower, and a BLAS with threads may add in an order that depends on their number. OpenMP's
/// setting is the calling thread's own; OpenBLAS's belongs to the process and is restored when the last guard
/// is gone.
class SingleThreaded {
  public:
    SingleThreaded();
    ~SingleThreaded();
    SingleThreaded(const SingleThreaded&) = delete;
    SingleThreaded& operator=(const SingleThreaded&) = delete;

  private:
    int openmp_levels_;
};

/// The file of the BLAS that CHOLMOD calls, and what it says of itself; "" where there is none, or it cannot tell.
std::string blas_path();
std::string blas_config();

/// How many threads that BLAS uses outside of a guard; 0 where it cannot tell.
int blas_threads();

}  // namespace magshell
