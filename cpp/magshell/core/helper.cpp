#include "magshell/core/helper.h"

#include <time.h>

#include <algorithm>

namespace magshell {

Nanoseconds processor_time() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time.tv_sec * Nanoseconds{1'000'000'000} + time.tv_nsec;
}

Nanoseconds give_way() {
    const Nanoseconds begin = clock_now();
    std::this_thread::yield();
    return clock_now() - begin;
}

void Rest::settle(Nanoseconds now, Nanoseconds worked, Nanoseconds put_aside, Nanoseconds waited) {
    constexpr Nanoseconds of_waiting = 16, shortest = 2'000'000, longest = 1'000'000'000, forgiven = 4;
    const Nanoseconds cost = std::min(put_aside, waited);
    const bool of_no_use = put_aside > moment && put_aside > worked;
    if (cost <= moment && !of_no_use) {
        worked_ += worked;
        if (worked_ > length_ / forgiven) length_ = 0;
        return;
    }
    length_ = std::min(longest, std::max({2 * length_, of_waiting * cost, shortest}));
    end_ = now + length_;
    worked_ = 0;
}

}  // namespace magshell
