// A pool of helper threads for one loop at a time. The caller processes parts of the loop as long as there are any, helpers take some of
// them, and at the end the caller waits only for parts that were begun.
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
    /// Starts no thread yet; helpers are started when a loop needs them.
    explicit Pool(int helpers);
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;
    ~Pool();

    int helpers() const { return helper_count_; }

    /// Runs a loop as parallel_for does. Only one loop at a time, and none within another.
    void run(int count, const std::function<void(int)>& body, PartTime& part_time);

  private:
    int work(int count, const std::function<void(int)>& body, PartTime& part_time);
    bool take(int& left);
    int done(int part, const std::function<void(int)>& body);
    bool wake_for(int parts, Nanoseconds part_time);
    void wake(int wanted);
    bool start(Helper& helper);
    Nanoseconds wait_for(int finished);
    void record_helpers(Nanoseconds waited);

    void serve(Helper& self);
    void stay_awake(Helper& self);
    void help(Watch& watch);

    const int helper_count_;
    const std::unique_ptr<Helper[]> helpers_;
    int started_ = 0;
    bool no_more_threads_ = false;
    std::atomic<bool> stop_{false};

    // The number of parts left. A thread that takes one keeps the loop from ending until it has reported, and only such a thread may read
    // the other members that describe the loop.
    alignas(64) std::atomic<int> left_{0};
    const std::function<void(int)>* body_ = nullptr;
    int count_ = 0;

    alignas(64) std::atomic<int> finished_{0};  // parts finished by helpers
    std::mutex error_mutex_;
    std::exception_ptr error_;
};

}  // namespace magshell
