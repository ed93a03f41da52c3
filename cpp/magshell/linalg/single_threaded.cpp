#include "magshell/linalg/single_threaded.h"

#ifdef MAGSHELL_HAS_CHOLMOD
#include <cholmod.h>
#endif
#include <dlfcn.h>

#include <mutex>

namespace magshell {

#ifdef MAGSHELL_HAS_CHOLMOD

namespace {

// Functions of CHOLMOD's own dependencies, looked up at run time: the system decides which BLAS and which
// OpenMP are loaded, not the build, and another package may have loaded a second one of either.
struct Dependencies {
    void* cholmod = handle();
    int (*openmp_levels)() = symbol<int()>("omp_get_max_active_levels");
    void (*set_openmp_levels)(int) = symbol<void(int)>("omp_set_max_active_levels");
    int (*blas_threads)() = symbol<int()>("openblas_get_num_threads");
    void (*set_blas_threads)(int) = symbol<void(int)>("openblas_set_num_threads");
    char* (*blas_config)() = symbol<char*()>("openblas_get_config");
    void* blas_routine = dlsym(cholmod, "dgemm_");

    static void* handle() {
        Dl_info info;
        if (dladdr(reinterpret_cast<const void*>(&cholmod_start), &info) == 0) return RTLD_DEFAULT;
        void* library = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
        return library ? library : RTLD_DEFAULT;
    }
    template <class Function>
    Function* symbol(const char* name) const {
        return reinterpret_cast<Function*>(dlsym(cholmod, name));
    }
};

const Dependencies& dependencies() {
    static const Dependencies found;
    return found;
}

std::mutex guards_mutex;
int guards = 0;
int threads_before = 0;

}  // namespace

SingleThreaded::SingleThreaded()
    : openmp_levels_(dependencies().openmp_levels ? dependencies().openmp_levels() : 1) {
    if (dependencies().set_openmp_levels) dependencies().set_openmp_levels(0);
    const std::lock_guard lock(guards_mutex);
    if (guards++ == 0 && dependencies().set_blas_threads && dependencies().blas_threads) {
        threads_before = dependencies().blas_threads();
        if (threads_before != 1) dependencies().set_blas_threads(1);
    }
}

SingleThreaded::~SingleThreaded() {
    if (dependencies().set_openmp_levels) dependencies().set_openmp_levels(openmp_levels_);
    const std::lock_guard lock(guards_mutex);
    if (--guards == 0 && threads_before > 1) dependencies().set_blas_threads(threads_before);
}

std::string blas_path() {
    Dl_info info;
    return dependencies().blas_routine && dladdr(dependencies().blas_routine, &info) && info.dli_fname
               ? info.dli_fname
               : "";
}

std::string blas_config() {
    return dependencies().blas_config ? dependencies().blas_config() : "";
}

int blas_threads() {
    return dependencies().blas_threads ? dependencies().blas_threads() : 0;
}

#else

SingleThreaded::SingleThreaded() : openmp_levels_(0) {}
SingleThreaded::~SingleThreaded() = default;
std::string blas_config() {
    return "";
}
std::string blas_path() {
    return "";
}
int blas_threads() {
    return 0;
}

#endif

}  // namespace magshell
