// WorkSpaces: work memory for the threads of a parallel loop.
#pragma once

#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {

/// Divides a buffer into equal parts, one per thread, so that a thread finds its own data in its caches again.
class WorkSpaces {
  public:
    WorkSpaces(slabs::Buffer& buffer, std::ptrdiff_t each) : each_(each) {
        for (std::ptrdiff_t begin = 0; each > 0 && begin + each <= buffer.size(); begin += each)
            free_.push_back(buffer.data() + begin);
    }

    double* of_this_thread() {
        const std::lock_guard lock(mutex_);
        double*& mine = taken_[std::this_thread::get_id()];
        if (mine) return mine;
        if (free_.empty()) {  // threads were added since the buffer was allocated
            extra_.emplace_back(each_);
            free_.push_back(extra_.back().data());
        }
        mine = free_.back();
        free_.pop_back();
        return mine;
    }

  private:
    const std::ptrdiff_t each_;
    std::mutex mutex_;
    std::vector<double*> free_;
    std::vector<slabs::Buffer> extra_;
    std::map<std::thread::id, double*> taken_;
};

/// The memory that one factorization writes besides the factor.
struct WorkMemory {
    slabs::Buffer shared, subtrees;

    std::size_t bytes() const { return sizeof(double) * (shared.size() + subtrees.size()); }
};

/// Work memory shared by the factors of one analysis: only one of them needs it at a time, and many of them may
/// be stored. It lives as long as any factor that was factorized.
class SharedWork {
  public:
    /// Takes the memory; empty if another thread has it.
    WorkMemory take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(memory_, {});
    }
    void give_back(WorkMemory memory) {
        const std::lock_guard lock(mutex_);
        memory_ = std::move(memory);
    }
    std::size_t bytes() {
        const std::lock_guard lock(mutex_);
        return memory_.bytes();
    }

  private:
    std::mutex mutex_;
    WorkMemory memory_;
};

}  // namespace magshell
