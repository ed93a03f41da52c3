#include "magshell/core/large_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <limits>
#include <new>

namespace magshell {
namespace {

constexpr std::size_t huge_page = std::size_t{1} << 21;
#ifdef __SANITIZE_ADDRESS__  // the sanitizer observes only what `new` allocates
constexpr std::size_t large = std::numeric_limits<std::size_t>::max();
#else
constexpr std::size_t large = 2 * huge_page;
#endif
constexpr std::align_val_t alignment{64};

std::size_t whole_pages(std::size_t bytes) {
    static const std::size_t page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    return (bytes + page - 1) / page * page;
}

}  // namespace

void* take_memory(std::size_t bytes) {
    if (bytes < large) return ::operator new(bytes, alignment);
    const std::size_t wanted = whole_pages(bytes), mapped = wanted + huge_page;
    if (mapped < bytes) throw std::bad_alloc();
    void* const from = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (from == MAP_FAILED) throw std::bad_alloc();
    // Returns the parts before the first boundary of a huge page, and behind what was requested, to the system.
    char* const begin = static_cast<char*>(from);
    const std::size_t before = -reinterpret_cast<std::uintptr_t>(begin) % huge_page;
    char* const memory = begin + before;
    if (before > 0) munmap(begin, before);
    if (before < huge_page) munmap(memory + wanted, huge_page - before);
#ifdef MADV_HUGEPAGE
    madvise(memory, wanted, MADV_HUGEPAGE);  // if the system refuses, small pages are used
#endif
    return memory;
}

void give_back_memory(void* memory, std::size_t bytes) noexcept {
    if (bytes < large)
        ::operator delete(memory, alignment);
    else
        munmap(memory, whole_pages(bytes));
}

}  // namespace magshell
