// SingleThreaded: a guard that keeps other libraries from using threads during a calculation.
#pragma once

#include <string>

namespace magshell {

/// While the object lives, OpenMP regions entered by this thread and calls of the BLAS run on one thread.
///
/// CHOLMOD as Debian ships it asks for four OpenMP threads whatever OMP_NUM_THREADS says, which makes it 1.5 to
/// 3.5 times slower, and a BLAS with threads may sum in an order that depends on their number. OpenMP's setting
/// belongs to the calling thread; OpenBLAS's belongs to the process and is restored when the last guard is
/// destroyed.
class SingleThreaded {
  public:
    SingleThreaded();
    ~SingleThreaded();
    SingleThreaded(const SingleThreaded&) = delete;
    SingleThreaded& operator=(const SingleThreaded&) = delete;

  private:
    int openmp_levels_;
};

/// Return the file of the BLAS that CHOLMOD calls, and its description of itself; "" if there is none or it is
/// unknown.
std::string blas_path();
std::string blas_config();

/// Returns the number of threads that BLAS uses outside of a guard; 0 if unknown.
int blas_threads();

}  // namespace magshell
