#include "magshell/core/parallel.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>

#include "magshell/core/pool.h"

namespace magshell {
namespace {

std::atomic<int> thread_count{1};

// Never destroyed at exit: after a fork, or while Python shuts down, its threads cannot be joined.
Pool* pool = nullptr;
pid_t pool_owner = 0;
std::atomic<pid_t> pool_user{0};  // the process whose loop the pool runs

// RAII claim of the pool for one loop. It is not a mutex, since the owning thread may claim it again within its loop, which is undefined for a
// mutex. A process that was forked during another thread's loop finds the number of its parent here, and may claim the pool.
class Claim {
  public:
    explicit Claim(pid_t process) {
        pid_t user = pool_user.load(std::memory_order_relaxed);
        granted_ =
            user != process && pool_user.compare_exchange_strong(user, process, std::memory_order_acquire);
    }
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;
    ~Claim() {
        if (granted_) pool_user.store(0, std::memory_order_release);
    }
    bool granted() const { return granted_; }

  private:
    bool granted_;
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

void parallel_for(int count, const std::function<void(int)>& body, PartTime& part_time) {
    const int wanted = num_threads() - 1;
    if (wanted < 1 || count < 2) return run_serially(count, body);
    const pid_t process = getpid();
    const Claim claim(process);
    if (!claim.granted()) return run_serially(count, body);

    if (pool_owner != process) pool = nullptr;  // its threads exist in the parent process only
    if (pool && pool->helpers() != wanted) {
        delete pool;
        pool = nullptr;
    }
    if (!pool) {
        pool = new Pool(wanted);
        pool_owner = process;
    }
    pool->run(count, body, part_time);
}

}  // namespace magshell
