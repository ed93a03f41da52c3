#include "magshell/core/parallel.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <system_error>
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

// To wake a sleeping thread takes as long as a whole loop over a few thousand faces. Loops follow each other
// closely, so threads look for the next one for a while (some 200 us) before they sleep.
constexpr int looks = 4000;

template <class Condition>
void look_for(const Condition& condition, int times) {
    for (int k = 0; k < times && !condition(); ++k) {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#endif
    }
}

// Where threads share processors, one that looks keeps another from its work.
int looks_of(int threads) {
    return threads <= static_cast<int>(std::thread::hardware_concurrency()) ? looks : 0;
}

// One parallel loop at a time runs on the pool; a nested or concurrent one runs on its caller's thread.
class Pool {
  public:
    explicit Pool(int wanted) : owner_(getpid()), wanted_(wanted), looks_(looks_of(wanted + 1)) {
        try {
            while (static_cast<int>(threads_.size()) < wanted) threads_.emplace_back([this] { work(); });
        } catch (const std::system_error&) {  // the system gives no more: those that run do the work
        }
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
    int wanted() const { return wanted_; }

    void run(int count, const std::function<void(int)>& body) {
        {
            const std::lock_guard lock(mutex_);
            body_ = &body;
            count_ = count;
            next_.store(0);
            busy_.store(static_cast<int>(threads_.size()));
            error_ = nullptr;
            ++round_;
        }
        wake_.notify_all();
        drain(body, count);
        const auto done = [this] { return busy_.load() == 0; };
        look_for(done, looks_);
        std::unique_lock lock(mutex_);
        done_.wait(lock, done);
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
            const auto wanted = [&] { return stop_.load() || round_.load() != seen; };
            look_for(wanted, looks_);
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, wanted);
                if (stop_) return;
                seen = round_;
                body = body_;
                count = count_;
            }
            drain(*body, count);
            if (busy_.fetch_sub(1) > 1) continue;
            const std::lock_guard lock(mutex_);
            done_.notify_one();
        }
    }

    const pid_t owner_;
    const int wanted_, looks_;
    std::vector<std::thread> threads_;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    const std::function<void(int)>* body_ = nullptr;
    int count_ = 0;
    std::atomic<int> next_{0};
    std::atomic<int> busy_{0};
    std::atomic<long> round_{0};
    std::atomic<bool> stop_{false};
    std::exception_ptr error_;
};

// Never destroyed at exit: after a fork, or while Python ends, its threads cannot be joined.
Pool* pool = nullptr;
std::atomic_flag pool_in_use;

// The pool for one loop, if no other has it. A flag and not a mutex: the thread that has it may ask again,
// from within its loop, which a mutex leaves undefined.
class Claim {
  public:
    Claim() : granted_(!pool_in_use.test_and_set(std::memory_order_acquire)) {}
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;
    ~Claim() {
        if (granted_) pool_in_use.clear(std::memory_order_release);
    }
    bool granted() const { return granted_; }

  private:
    const bool granted_;
};

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
    const int wanted = num_threads() - 1;
    if (wanted < 1 || count < 2) return run_serially(count, body);
    const Claim claim;
    if (!claim.granted()) return run_serially(count, body);

    if (pool && pool->forked()) pool = nullptr;  // its threads stayed in the parent
    if (pool && pool->wanted() != wanted) {
        pool->stop();
        delete pool;
        pool = nullptr;
    }
    if (!pool) pool = new Pool(wanted);
    pool->run(count, body);
}

}  // namespace magshell
