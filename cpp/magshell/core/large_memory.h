// An allocator for large arrays, in huge pages if the system provides them. Fresh memory costs a page fault per page, and a factorization
// accesses more small pages than the processor caches addresses for.
#pragma once

#include <cstddef>
#include <vector>

namespace magshell {

/// Returns memory aligned to 64 bytes, not initialised. Throws std::bad_alloc.
void* take_memory(std::size_t bytes);
void give_back_memory(void* memory, std::size_t bytes) noexcept;

/// An allocator for arrays that may become large.
template <class T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <class Other>
    LargeAllocator(const LargeAllocator<Other>&) {}
    T* allocate(std::size_t count) { return static_cast<T*>(take_memory(sizeof(T) * count)); }
    void deallocate(T* memory, std::size_t count) noexcept { give_back_memory(memory, sizeof(T) * count); }
    friend bool operator==(const LargeAllocator&, const LargeAllocator&) { return true; }
};

template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace magshell
