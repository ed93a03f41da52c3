#include "magshell/energy/own_field_pairs.h"

#include <algorithm>
#include <cstring>

#include "magshell/core/vector3.h"
#include "magshell/energy/simd_dual.h"

namespace magshell {
namespace {

constexpr std::size_t width = SimdDouble::width;

SimdDouble load(const std::vector<double>& numbers, std::size_t first) {
    SimdDouble out;
    std::memcpy(&out.lanes, numbers.data() + first, sizeof out.lanes);
    return out;
}

SimdVec3 load(const std::vector<double>* numbers, std::size_t first) {
    return {load(numbers[0], first), load(numbers[1], first), load(numbers[2], first)};
}

Triple<double> sum_of_lanes(const SimdVec3& a) {
    return {sum_of_lanes(a.x), sum_of_lanes(a.y), sum_of_lanes(a.z)};
}

Triple<Dual> sum_of_lanes(const SimdVec3& value, const SimdVec3& rate) {
    return {{sum_of_lanes(value.x), sum_of_lanes(rate.x)},
            {sum_of_lanes(value.y), sum_of_lanes(rate.y)},
            {sum_of_lanes(value.z), sum_of_lanes(rate.z)}};
}

// Calls body(first, mask) for the SIMD vectors of [first, last); the mask is 1 in lanes of the range that are not skipped, 0 in others.
template <class Body>
void each_vector(std::size_t first, std::size_t last, std::size_t skip, std::size_t skip_end,
                 const Body& body) {
    for (std::size_t begin = first / width * width; begin < last; begin += width) {
        const bool partial =
            begin < first || begin + width > last || (begin < skip_end && begin + width > skip);
        SimdDouble mask(1.0);
        if (partial)
            for (std::size_t lane = 0; lane < width; ++lane) {
                const std::size_t k = begin + lane;
                mask.set(static_cast<int>(lane),
                         k < first || k >= last || (k >= skip && k < skip_end) ? 0.0 : 1.0);
            }
        body(begin, partial, mask);
    }
}

// Moves masked lanes a unit length away, so that a distance of zero does no harm.
SimdVec3 moved(SimdVec3 distance, const SimdDouble& mask) {
    distance.x += SimdDouble(1.0) - mask;
    return distance;
}

}  // namespace

void SourceArrays::resize(std::size_t count, bool has_currents, bool has_rates) {
    count_ = count;
    has_currents_ = has_currents;
    const std::size_t padded = (count + width - 1) / width * width;
    for (int k = 0; k < components; ++k) {
        values_[k].assign(k < 4 || has_currents ? padded : 0, k < 3 ? far_away : 0.0);
        rates_[k].assign(has_rates && (k < 4 || has_currents) ? padded : 0, 0.0);
    }
}

template <class T>
void SourceArrays::set(std::size_t k, const SourcePoint<T>& point) {
    const T* numbers[components] = {&point.at.x,      &point.at.y,      &point.at.z,     &point.charge,
                                    &point.current.x, &point.current.y, &point.current.z};
    for (int c = 0; c < (has_currents_ ? components : 4); ++c) {
        values_[c][k] = value_of(*numbers[c]);
        if (!rates_[c].empty()) rates_[c][k] = rate_of(*numbers[c]);
    }
}

void SourceArrays::gather(const SourceArrays& from, const std::vector<std::array<std::size_t, 2>>& ranges) {
    std::size_t count = 0;
    for (const auto& [first, last] : ranges) count += last - first;
    resize(count, from.has_currents_, !from.rates_[0].empty());
    for (int c = 0; c < (has_currents_ ? components : 4); ++c) {
        std::size_t to = 0;
        for (const auto& [first, last] : ranges) {
            std::copy(from.values_[c].begin() + first, from.values_[c].begin() + last,
                      values_[c].begin() + to);
            if (!rates_[c].empty())
                std::copy(from.rates_[c].begin() + first, from.rates_[c].begin() + last,
                          rates_[c].begin() + to);
            to += last - first;
        }
    }
}

template <class T>
void SourceArrays::add_sums(const SourcePoint<T>& point, std::size_t first, std::size_t last,
                            std::size_t skip, std::size_t skip_end, SourceSums<T>& out) const {
    if (has_currents_)
        add<true>(point, first, last, skip, skip_end, out);
    else
        add<false>(point, first, last, skip, skip_end, out);
}

template <bool has_currents>
void SourceArrays::add(const SourcePoint<double>& point, std::size_t first, std::size_t last,
                       std::size_t skip, std::size_t skip_end, SourceSums<double>& out) const {
    const SimdVec3 at = broadcast(values_of(point.at)), current = broadcast(values_of(point.current));
    const SimdDouble charge(point.charge), zero(0.0);
    SimdDouble charges(0.0);
    SimdVec3 currents{zero, zero, zero}, pull{zero, zero, zero};
    each_vector(first, last, skip, skip_end, [&](std::size_t k, bool partial, const SimdDouble& mask) {
        SimdVec3 d = at - load(values_, k);
        if (partial) d = moved(d, mask);
        SimdDouble inverse = inverse_root(squared_norm(d));
        if (partial) inverse *= mask;
        const SimdDouble q = load(values_[3], k);
        charges += q * inverse;
        SimdDouble strength = charge * q;
        if constexpr (has_currents) {
            const SimdVec3 c = load(values_ + 4, k);
            currents += inverse * c;
            strength -= dot(current, c);
        }
        pull += (strength * inverse * inverse * inverse) * d;
    });
    out.charges += sum_of_lanes(charges);
    out.pull += sum_of_lanes(pull);
    if constexpr (has_currents) out.currents += sum_of_lanes(currents);
}

// d(1/r) = - (d . d') / r^3;  d(1/r^3) = - 3 (d . d') / r^5
template <bool has_currents>
void SourceArrays::add(const SourcePoint<Dual>& point, std::size_t first, std::size_t last, std::size_t skip,
                       std::size_t skip_end, SourceSums<Dual>& out) const {
    const SimdVec3 at = broadcast(values_of(point.at)), at_rate = broadcast(rates_of(point.at)),
                   current = broadcast(values_of(point.current)),
                   current_rate = broadcast(rates_of(point.current));
    const SimdDouble charge(point.charge.value), charge_rate(point.charge.rate), zero(0.0), three(3.0);
    const SimdVec3 none{zero, zero, zero};
    SimdDouble charges = zero, charges_rate = zero;
    SimdVec3 currents = none, currents_rate = none, pull = none, pull_rate = none;
    each_vector(first, last, skip, skip_end, [&](std::size_t k, bool partial, const SimdDouble& mask) {
        SimdVec3 d = at - load(values_, k);
        if (partial) d = moved(d, mask);
        const SimdVec3 d_rate = at_rate - load(rates_, k);
        SimdDouble inverse = inverse_root(squared_norm(d));
        if (partial) inverse *= mask;
        const SimdDouble growth = dot(d, d_rate) * inverse * inverse;  // r' / r
        const SimdDouble q = load(values_[3], k), q_rate = load(rates_[3], k);
        charges += q * inverse;
        charges_rate += (q_rate - q * growth) * inverse;
        SimdDouble strength = charge * q, strength_rate = charge_rate * q + charge * q_rate;
        if constexpr (has_currents) {
            const SimdVec3 c = load(values_ + 4, k), c_rate = load(rates_ + 4, k);
            currents += inverse * c;
            currents_rate += inverse * (c_rate - growth * c);
            strength -= dot(current, c);
            strength_rate -= dot(current_rate, c) + dot(current, c_rate);
        }
        const SimdDouble cubed = inverse * inverse * inverse;
        pull += (strength * cubed) * d;
        pull_rate += cubed * ((strength_rate - three * strength * growth) * d + strength * d_rate);
    });
    out.charges += Dual(sum_of_lanes(charges), sum_of_lanes(charges_rate));
    out.pull += sum_of_lanes(pull, pull_rate);
    if constexpr (has_currents) out.currents += sum_of_lanes(currents, currents_rate);
}

template void SourceArrays::set(std::size_t, const SourcePoint<double>&);
template void SourceArrays::set(std::size_t, const SourcePoint<Dual>&);
template void SourceArrays::add_sums(const SourcePoint<double>&, std::size_t, std::size_t, std::size_t,
                                     std::size_t, SourceSums<double>&) const;
template void SourceArrays::add_sums(const SourcePoint<Dual>&, std::size_t, std::size_t, std::size_t,
                                     std::size_t, SourceSums<Dual>&) const;

}  // namespace magshell
