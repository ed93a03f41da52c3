#include "magshell/core/helper.h"

#include <time.h>

#include <algorithm>

namespace magshell {

namespace {

constexpr Nanoseconds yield_interval = 50'000;  // [ns] minimum interval between yields, which cost 1 us each

void add(std::atomic<Nanoseconds>& sum, Nanoseconds more) {
    sum.fetch_add(more, std::memory_order_relaxed);
}

Nanoseconds processor_time() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time.tv_sec * Nanoseconds{1'000'000'000} + time.tv_nsec;
}

}  // namespace

Watch::Watch(Helper& helper) : helper_(helper), compared_(clock_now()), processor_(processor_time()) {}

/// Returns for how long the thread was suspended since the last call, 0 if that was less than `moment` [ns].
Nanoseconds Watch::put_aside() {
    const Nanoseconds clock = compared_, processor = processor_;
    processor_ = processor_time();
    compared_ = clock_now();
    const Nanoseconds time = (compared_ - clock) - (processor_ - processor);
    if (time <= moment) return 0;
    add(helper_.put_aside, time);
    return time;
}

void Watch::end_part() {
    const Nanoseconds took = clock_now() - part_began_;
    if (took <= moment) return add(helper_.worked, took);
    const Nanoseconds aside = std::min(put_aside(), took);
    add(helper_.worked, took - aside);
    add(helper_.put_aside_in_part, aside);
}

bool Watch::yield_to_others() {
    if (clock_now() - yielded_ < yield_interval) return false;
    std::this_thread::yield();
    const Nanoseconds time = put_aside();
    yielded_ = compared_;
    return time > 0;
}

void HelperBackoff::record_loop(Nanoseconds now, Nanoseconds worked, Nanoseconds put_aside,
                                Nanoseconds waited) {
#if defined(__SANITIZE_THREAD__)
    return;  // help even on a busy machine
#endif
    constexpr Nanoseconds of_waiting = 20, shortest = 2'000'000, longest = 250'000'000, forgiven = 4;
    const Nanoseconds cost = std::min(put_aside, waited);
    const bool of_no_use = put_aside > moment && put_aside > worked;
    if (cost <= moment && !of_no_use) {
        worked_ += worked;
        if (worked_ > length_ / forgiven) length_ = 0;
        return;
    }
    length_ = std::max({std::min(2 * length_, longest), of_waiting * cost, shortest});
    end_ = now + length_;
    worked_ = 0;
}

}  // namespace magshell
