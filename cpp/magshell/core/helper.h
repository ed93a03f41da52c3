// A helper thread for parallel loops, which stays active as long as it has a processor to itself, and backs off when it has been of no use.
//
// If the system suspends a helper in the middle of a part of a loop, the caller waits for as long as the other program runs, some
// milliseconds, which is longer than a loop. Helpers therefore yield to other programs between parts, where nobody waits for them, and those
// that had to share their processor are not used for a while (exponential back-off).
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

/// Suspensions shorter than this are ignored [ns]: the work of the system takes some ten microseconds.
inline constexpr Nanoseconds moment = 100'000;

/// The time for which a helper is not used. It begins with a multiple of the cost of its last loop, so that waiting for helpers remains
/// a small part of the time, and doubles with each further cost until the helper has worked long enough.
class HelperBackoff {
  public:
    bool over(Nanoseconds now) const { return now >= end_; }

    /// Records a loop: how long the helper worked, was suspended, and kept the caller waiting [ns].
    void record_loop(Nanoseconds now, Nanoseconds worked, Nanoseconds put_aside, Nanoseconds waited);

  private:
    Nanoseconds end_ = 0, length_ = 0, worked_ = 0;
};

// The state that a helper and the caller of loops share, on a cache line of its own.
struct alignas(64) Helper {
    std::thread thread;
    HelperBackoff backoff;  // used by the caller only

    std::atomic<std::uint32_t> bell{0};  // changed by the caller; a sleeping helper waits for a change
    std::atomic<bool> asleep{false};
    std::atomic<bool> resting{false};  // set by the caller

    std::atomic<Nanoseconds> worked{0}, put_aside{0};  // [ns] since the caller last read them
    std::atomic<Nanoseconds> put_aside_in_part{0};     // [ns] the largest suspension within one part
};

// Detects that a helper was suspended, by comparing the clock with the processor time of its thread.
class Watch {
  public:
    explicit Watch(Helper& helper);

    void begin_part() { part_began_ = clock_now(); }
    void end_part();

    /// Yields the processor to another thread if one is waiting, at intervals. Returns true if another one ran for more than `moment`
    /// since the last call.
    bool yield_to_others();

  private:
    Nanoseconds put_aside();

    Helper& helper_;
    Nanoseconds compared_, processor_;  // the clock, and the processor time of this thread at that time
    Nanoseconds part_began_ = 0, yielded_ = 0;
};

}  // namespace magshell
