// A thread that helps with loops, as long as it has a processor to itself, and when it was last no use.
//
// A helper that the system puts aside in the middle of a part keeps the loop's caller waiting for as long as
// the other program may run, some milliseconds, which is longer than a loop. So helpers give way to others
// between parts, where nobody waits for them, and those that had to share their processor rest for a while.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace magshell {

using Nanoseconds = std::int64_t;

inline Nanoseconds clock_now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// Less than this passes unnoticed: the system's own work takes a processor for some ten microseconds.
inline constexpr Nanoseconds moment = 100'000;

/// How long a helper is to be left alone. It begins with a multiple of what its last loop cost, so that
/// waiting for helpers stays a small part of the time, and doubles from one cost to the next until it has
/// been of use for a while.
class Rest {
  public:
    bool over(Nanoseconds now) const { return now >= end_; }

    /// The helper worked for so long, was put aside for so long, and kept the caller waiting for so long.
    void settle(Nanoseconds now, Nanoseconds worked, Nanoseconds put_aside, Nanoseconds waited);

  private:
    Nanoseconds end_ = 0, length_ = 0, worked_ = 0;
};

// What a helper and the caller of loops tell each other, apart from what others do.
struct alignas(64) Helper {
    std::thread thread;
    Rest rest;  // the caller's

    std::atomic<std::uint32_t> bell{0};  // rung by the caller; a sleeping helper waits for it to change
    std::atomic<bool> asleep{false};
    std::atomic<bool> resting{false};  // by the caller's word

    std::atomic<Nanoseconds> worked{0}, put_aside{0};  // since the caller last asked
    std::atomic<Nanoseconds> put_aside_in_part{0};     // of it, the most in one part
};

// How a helper finds out that it was put aside: by comparing the clock with its share of the processor, now
// and then.
class Watch {
  public:
    explicit Watch(Helper& helper);

    void begin_part() { part_began_ = clock_now(); }
    void end_part();

    /// Lets another thread have this processor if one waits for it, now and then. True if one had it for more
    /// than a moment, now or since.
    bool give_way();

  private:
    Nanoseconds put_aside();

    Helper& helper_;
    Nanoseconds compared_, processor_;  // the clock, and this thread's share of it until then
    Nanoseconds part_began_ = 0, gave_way_ = 0;
};

}  // namespace magshell
