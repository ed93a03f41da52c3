// Work space for the threads of one loop.
#pragma once

#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "magshell/linalg/slabs.h"

namespace magshell {

/// Equal parts of a buffer, one for each thread, which finds in its caches what it wrote there before.
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
        if (free_.empty()) {  // threads were added since the buffer was made
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

/// What one factorization writes besides the factor.
struct WorkMemory {
    slabs::Buffer shared, subtrees;

    std::size_t bytes() const { return sizeof(double) * (shared.size() + subtrees.size()); }
};

/// Work memory that factors of one analysis share: it is needed only while one of them is computed, and many
/// of them may be kept. Lives as long as one that was factorized does.
class SharedWork {
  public:
    /// Empty where another thread has it.
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
