#include "magshell/mesh/space_filling_order.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// Spreads the lowest 21 bits of v to every third bit.
std::uint64_t spread_bits(std::uint64_t v) {
    std::uint64_t spread = 0;
    for (int bit = 0; bit < 21; ++bit) spread |= ((v >> bit) & 1u) << (3 * bit);
    return spread;
}

thread_local ScopedOrders* given = nullptr;

}  // namespace

ScopedOrders::ScopedOrders(std::vector<Renumbering> orders) : orders_(std::move(orders)) {
    given = this;
}

ScopedOrders::~ScopedOrders() {
    given = nullptr;
}

const Renumbering& ScopedOrders::next(std::size_t size) {
    if (next_ == orders_.size() || orders_[next_].user.size() != size)
        throw InvalidInput("a scene cannot be numbered like one with other elements");
    return orders_[next_++];
}

Renumbering order_along_curve(const std::vector<Vec3>& points) {
    if (given) return given->next(points.size());
    Vec3 lowest = Vec3::Constant(std::numeric_limits<double>::max()), highest = -lowest;
    for (const Vec3& p : points) {
        lowest = lowest.cwiseMin(p);
        highest = highest.cwiseMax(p);
    }
    const double extent = std::max((highest - lowest).maxCoeff(), std::numeric_limits<double>::min());
    std::vector<std::uint64_t> keys(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
        const Vec3 scaled = (points[k] - lowest) / extent * 2097151.0;
        keys[k] = spread_bits(static_cast<std::uint64_t>(scaled.x())) |
                  spread_bits(static_cast<std::uint64_t>(scaled.y())) << 1 |
                  spread_bits(static_cast<std::uint64_t>(scaled.z())) << 2;
    }
    std::vector<Index> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return keys[a] < keys[b]; });
    return Renumbering::from_user_order(std::move(order));
}

}  // namespace magshell
