// A numbering along a space-filling curve, which keeps neighbours close in memory, whatever the order of the
// caller's mesh.
#pragma once

#include <vector>

#include "magshell/core/renumbering.h"

namespace magshell {

/// Numbers points along a Morton curve through them; points with equal keys keep their order. Within a ScopedOrders the order is its next one.
Renumbering order_along_curve(const std::vector<Vec3>& points);

/// RAII guard that gives order_along_curve() its results, one after another, in this thread: a scene in another shape is numbered like the
/// one from which they are. Throws InvalidInput, in order_along_curve(), where one does not fit.
class ScopedOrders {
  public:
    explicit ScopedOrders(std::vector<Renumbering> orders);
    ~ScopedOrders();
    ScopedOrders(const ScopedOrders&) = delete;
    ScopedOrders& operator=(const ScopedOrders&) = delete;

    const Renumbering& next(std::size_t size);

  private:
    std::vector<Renumbering> orders_;
    std::size_t next_ = 0;
};

}  // namespace magshell
