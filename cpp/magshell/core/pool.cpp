#include "magshell/core/pool.h"

#include <algorithm>
#include <utility>

namespace magshell {
namespace {

// Waking a sleeping thread costs the caller 10 us, and it starts after another 30 us, so a loop must be long enough. Loops follow each other
// closely, so helpers look for the next one for a while before they sleep.
#if defined(__SANITIZE_THREAD__)  // the small scenes of tests are to meet several threads
constexpr Nanoseconds worth_waking = 1, worth_a_helper = 1, patience = 20'000'000;
#else
constexpr Nanoseconds worth_waking = 100'000, worth_a_helper = 50'000;
constexpr Nanoseconds patience = 200'000;  // [ns] for which a helper looks for the next loop
#endif
constexpr Nanoseconds short_wait = 100'000;  // [ns] for which the caller waits actively

void pause() {
    for (int k = 0; k < 8; ++k) {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#elif defined(__aarch64__)
        asm volatile("yield");
#endif
    }
}

// Limits the measured time of a part, which is too long if the system suspended the caller: that alone should wake nobody.
Nanoseconds believable(Nanoseconds part_time, Nanoseconds before) {
    return before > 0 ? std::min(part_time, 4 * before) : part_time;
}

}  // namespace

Pool::Pool(int helpers) : helper_count_(helpers), helpers_(new Helper[helpers]) {}

Pool::~Pool() {
    stop_.store(true);
    for (int k = 0; k < started_; ++k) {
        helpers_[k].bell.fetch_add(1);
        helpers_[k].bell.notify_one();
    }
    for (int k = 0; k < started_; ++k) helpers_[k].thread.join();
}

void Pool::run(int count, const std::function<void(int)>& body, PartTime& part_time) {
    body_ = &body;
    count_ = count;
    finished_.store(0, std::memory_order_relaxed);
    left_.store(count, std::memory_order_release);
    const int own = work(count, body, part_time);
    record_helpers(wait_for(count - own));
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

/// Processes parts of the loop in the caller and returns their number. Sleeping helpers are woken at once if the same loop was long enough
/// in its last run, otherwise when it turns out to be.
int Pool::work(int count, const std::function<void(int)>& body, PartTime& part_time) {
    const Nanoseconds begin = clock_now(), before = part_time.load(std::memory_order_relaxed);
    bool woken = wake_for(count - 1, before);
    int own = 0;
    for (int left; take(left);) {
        own += done(count - left, body);
        if (woken) continue;
        const Nanoseconds a_part = believable((clock_now() - begin) / own, before);
        woken = wake_for(left_.load(std::memory_order_relaxed), a_part);
    }
    if (own > 0) part_time.store(believable((clock_now() - begin) / own, before), std::memory_order_relaxed);
    return own;
}

bool Pool::wake_for(int parts, Nanoseconds part_time) {
    const Nanoseconds work = parts * part_time;
    if (work < worth_waking) return false;
    wake(static_cast<int>(std::min<Nanoseconds>(parts, work / worth_a_helper)));
    return true;
}

/// Takes one of the parts that are left, counted from the end. Returns false if there is none.
bool Pool::take(int& left) {
    if (left_.load(std::memory_order_relaxed) <= 0) return false;
    left = left_.fetch_sub(1, std::memory_order_acquire);
    return left > 0;
}

/// Processes a part and returns how many parts this completes: after an exception, all that are left.
int Pool::done(int part, const std::function<void(int)>& body) {
    try {
        body(part);
        return 1;
    } catch (...) {
        const int cancelled = std::max(0, left_.exchange(0, std::memory_order_relaxed));
        const std::lock_guard lock(error_mutex_);
        if (!error_) error_ = std::current_exception();
        return 1 + cancelled;
    }
}

void Pool::wake(int wanted) {
    const Nanoseconds now = clock_now();
    for (int k = 0; k < helper_count_ && wanted > 0; ++k) {
        Helper& helper = helpers_[k];
        if (k == started_) {
            if (!start(helper)) return;
        } else {
            if (!helper.backoff.over(now)) continue;
            helper.resting.store(false, std::memory_order_relaxed);
            if (helper.asleep.exchange(false, std::memory_order_relaxed)) {
                helper.bell.fetch_add(1);
                helper.bell.notify_one();
            }
        }
        --wanted;
    }
}

bool Pool::start(Helper& helper) {
    if (no_more_threads_) return false;
    try {
        helper.thread = std::thread([this, &helper] { serve(helper); });
    } catch (const std::exception&) {  // the system has no more threads: the existing ones do the work
        no_more_threads_ = true;
        return false;
    }
    ++started_;
    return true;
}

/// Waits until helpers have finished this number of parts. Returns the time waited [ns].
Nanoseconds Pool::wait_for(int finished) {
    if (finished_.load(std::memory_order_acquire) >= finished) return 0;
    const Nanoseconds begin = clock_now();
    while (finished_.load(std::memory_order_acquire) < finished && clock_now() - begin < short_wait) pause();
    // Sleeps, so that a helper that waits for a processor may have this one.
    for (int now; (now = finished_.load(std::memory_order_acquire)) < finished;)
        finished_.wait(now, std::memory_order_acquire);
    return clock_now() - begin;
}

void Pool::record_helpers(Nanoseconds waited) {
    const auto read = [](std::atomic<Nanoseconds>& sum) {
        return sum.load(std::memory_order_relaxed) ? sum.exchange(0, std::memory_order_relaxed) : 0;
    };
    for (int k = 0; k < started_; ++k) {
        Helper& helper = helpers_[k];
        const Nanoseconds worked = read(helper.worked), put_aside = read(helper.put_aside);
        const Nanoseconds in_part = read(helper.put_aside_in_part);
        if (worked == 0 && put_aside == 0) continue;
        const Nanoseconds now = clock_now();
        helper.backoff.record_loop(now, worked, put_aside, std::min(waited, in_part));
        if (!helper.backoff.over(now)) helper.resting.store(true, std::memory_order_relaxed);
    }
}

void Pool::serve(Helper& self) {
    for (;;) {
        const std::uint32_t rung = self.bell.load();
        if (stop_.load()) return;
        stay_awake(self);
        self.asleep.store(true, std::memory_order_relaxed);
        self.bell.wait(rung);
    }
}

/// Helps with one loop after another, until none follows or others need the processor.
void Pool::stay_awake(Helper& self) {
    Watch watch(self);
    Nanoseconds last_loop = clock_now();
    while (!stop_.load(std::memory_order_relaxed) && !self.resting.load(std::memory_order_relaxed)) {
        const bool put_aside = watch.yield_to_others();
        if (left_.load(std::memory_order_relaxed) > 0) {
            help(watch);
            last_loop = clock_now();
        } else if (put_aside || clock_now() - last_loop > patience) {
            return;
        } else {
            pause();
        }
    }
}

void Pool::help(Watch& watch) {
    for (int left; take(left); watch.yield_to_others()) {
        watch.begin_part();
        const int parts = done(count_ - left, *body_);
        watch.end_part();
        finished_.fetch_add(parts, std::memory_order_release);
        finished_.notify_one();
    }
}

}  // namespace magshell
