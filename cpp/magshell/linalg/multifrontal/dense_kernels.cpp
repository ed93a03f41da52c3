#include "magshell/linalg/multifrontal/dense_kernels.h"

#include <cstdlib>
#include <string_view>

namespace magshell {

#ifdef MAGSHELL_HAS_WIDE_KERNELS
namespace avx512 {
extern const DenseKernels own_kernels;
}

namespace {

bool is_wide() {
    const char* wanted = std::getenv("MAGSHELL_VECTORS");
    if (wanted && std::string_view(wanted) == "baseline") return false;
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
}

}  // namespace

const DenseKernels& dense_kernels() {
    static const DenseKernels& chosen = is_wide() ? avx512::own_kernels : own_kernels;
    return chosen;
}
#else
const DenseKernels& dense_kernels() {
    return own_kernels;
}
#endif

}  // namespace magshell
