// Threads that help with one loop at a time. The caller does a loop's parts as long as there are any, helpers
// take some of them where they can, and at the end the caller waits only for parts that were begun.
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>

#include "magshell/core/helper.h"
#include "magshell/core/parallel.h"

namespace magshell {

class Pool {
  public:
    /// Its helpers are started when a loop first wants them.
    explicit Pool(int helpers);
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;
    ~Pool();

    int helpers() const { return helper_count_; }

    /// As parallel_for. One loop at a time, and none from within another.
    void run(int count, const std::function<void(int)>& body, PartTime& part_time);

  private:
    int work(int count, const std::function<void(int)>& body, PartTime& part_time);
    bool take(int& left);
    int done(int part, const std::function<void(int)>& body);
    bool wake_for(int parts, Nanoseconds part_time);
    void wake(int wanted);
    bool start(Helper& helper);
    Nanoseconds wait_for(int finished);
    void settle(Nanoseconds waited);

    void serve(Helper& self);
    void stay_awake(Helper& self);
    void help(Watch& watch);

    const int helper_count_;
    const std::unique_ptr<Helper[]> helpers_;
    int started_ = 0;
    bool no_more_threads_ = false;
    std::atomic<bool> stop_{false};

    // A loop is there while parts of it are left. Whoever takes one keeps the loop from ending until it has
    // reported, and only then may read what the loop is.
    alignas(64) std::atomic<int> left_{0};
    const std::function<void(int)>* body_ = nullptr;
    int count_ = 0;

    alignas(64) std::atomic<int> finished_{0};  // by helpers
    std::mutex error_mutex_;
    std::exception_ptr error_;
};

}  // namespace magshell
