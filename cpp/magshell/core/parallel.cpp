#include "magshell/core/parallel.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace magshell {
namespace {

int initial_threads() {
    if (const char* wanted = std::getenv("MAGSHELL_NUM_THREADS")) {
        const int count = std::atoi(wanted);
        if (count >= 1) return count;
    }
    return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
}

std::atomic<int> thread_count{initial_threads()};

// One parallel loop at a time runs on the pool; a nested or concurrent one runs on its caller's thread.
class Pool {
  public:
    explicit Pool(int workers) : owner_(getpid()) {
        for (int i = 0; i < workers; ++i) threads_.emplace_back([this] { work(); });
    }

    void stop() {
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_) thread.join();
    }

    bool forked() const { return owner_ != getpid(); }
    int workers() const { return static_cast<int>(threads_.size()); }

    void run(int count, const std::function<void(int)>& body) {
        {
            const std::lock_guard lock(mutex_);
            body_ = &body;
            count_ = count;
            next_.store(0);
            busy_ = static_cast<int>(threads_.size());
            error_ = nullptr;
            ++round_;
        }
        wake_.notify_all();
        drain(body, count);
        std::unique_lock lock(mutex_);
        done_.wait(lock, [this] { return busy_ == 0; });
        body_ = nullptr;
        if (error_) std::rethrow_exception(error_);
    }

  private:
    void drain(const std::function<void(int)>& body, int count) {
        for (int i = next_.fetch_add(1); i < count; i = next_.fetch_add(1)) {
            try {
                body(i);
            } catch (...) {
                const std::lock_guard lock(mutex_);
                if (!error_) error_ = std::current_exception();
                next_.store(count);
            }
        }
    }

    void work() {
        long seen = 0;
        for (;;) {
            const std::function<void(int)>* body;
            int count;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [&] { return stop_ || round_ != seen; });
                if (stop_) return;
                seen = round_;
                body = body_;
                count = count_;
            }
            drain(*body, count);
            const std::lock_guard lock(mutex_);
            if (--busy_ == 0) done_.notify_one();
        }
    }

    const pid_t owner_;
    std::vector<std::thread> threads_;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    const std::function<void(int)>* body_ = nullptr;
    int count_ = 0;
    std::atomic<int> next_{0};
    int busy_ = 0;
    long round_ = 0;
    bool stop_ = false;
    std::exception_ptr error_;
};

std::mutex pool_in_use;
Pool* pool =
    nullptr;  // never destroyed at exit: after a fork, or while Python ends, its threads cannot be joined

void run_serially(int count, const std::function<void(int)>& body) {
    for (int i = 0; i < count; ++i) body(i);
}

}  // namespace

int num_threads() {
    return thread_count.load();
}

void set_num_threads(int count) {
    thread_count.store(std::max(1, count));
}

void parallel_for(int count, const std::function<void(int)>& body) {
    const int workers = std::min(num_threads(), count) - 1;
    const std::unique_lock lock(pool_in_use, std::try_to_lock);
    if (workers < 1 || !lock.owns_lock()) return run_serially(count, body);

    const int wanted = num_threads() - 1;
    if (pool && pool->forked()) pool = nullptr;  // its threads stayed in the parent
    if (pool && pool->workers() != wanted) {
        pool->stop();
        delete pool;
        pool = nullptr;
    }
    if (!pool) pool = new Pool(wanted);
    pool->run(count, body);
}

}  // namespace magshell
