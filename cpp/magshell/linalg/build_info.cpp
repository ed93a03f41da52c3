#include "magshell/linalg/build_info.h"

#include <Eigen/Core>

#include "magshell/linalg/multifrontal/dense_kernels.h"
#include "magshell/linalg/single_threaded.h"
#ifdef MAGSHELL_HAS_CHOLMOD
#include <cholmod.h>
#endif

namespace magshell {
namespace {

std::string version(int major, int minor, int patch) {
    return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> linalg_build_info() {
    std::vector<std::pair<std::string, std::string>> info;
#if defined(__clang__)
    info.emplace_back("compiler", __VERSION__);  // begins with "Clang"
#elif defined(__GNUC__)
    info.emplace_back("compiler", "GCC " __VERSION__);
#endif
    const std::string dense = dense_kernels().vectors;
    const std::string rest = own_kernels.vectors;
    info.emplace_back("vector instructions", dense == rest ? rest : rest + ", in factorizations " + dense);
    info.emplace_back("Eigen", version(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION));
#ifdef MAGSHELL_HAS_CHOLMOD
    info.emplace_back("CHOLMOD", version(CHOLMOD_MAIN_VERSION, CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION));
    info.emplace_back("SuiteSparse",
                      version(SUITESPARSE_MAIN_VERSION, SUITESPARSE_SUB_VERSION, SUITESPARSE_SUBSUB_VERSION));
    info.emplace_back("BLAS of CHOLMOD", blas_path());
    info.emplace_back("BLAS configuration", blas_config());
    info.emplace_back("BLAS threads", std::to_string(blas_threads()) + " (1 inside magshell)");
#endif
    return info;
}

}  // namespace magshell
