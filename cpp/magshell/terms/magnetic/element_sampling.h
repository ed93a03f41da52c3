// ElementSampling: the points at which each element of a solid or of a six-node shell samples the applied field, those of its own rule, or
// finely, those of a longer one.
//
// A SIMD vector has a slot for each point of that element of it which has most. An element of fewer points fills the last slots with zeros.
#pragma once

#include <algorithm>
#include <vector>

#include "magshell/terms/magnetic/field_groups.h"

namespace magshell {

class ElementSampling {
  public:
    /// coarse, fine: the numbers of points, which differ.
    ElementSampling(Index n_elements, Index groups, int coarse, int fine)
        : n_elements_(n_elements), groups_(groups), coarse_(coarse), fine_(fine) {}

    /// Sets which elements sample the field finely, by numbers that are not zero.
    template <class Loop>
    void set(const Loop& loop, const double* fine) {
        first_.clear();
        slots_.clear();
        if (std::all_of(fine, fine + n_elements_, [](double each) { return each == 0.0; })) return;
        first_.push_back(0);
        for (Index e = 0; e < n_elements_; ++e)
            first_.push_back(first_.back() + (fine[e] != 0.0 ? fine_ : coarse_));
        slots_.push_back(0);
        for (Index group = 0; group < groups_; ++group) {
            bool any = false;
            for (int lane = 0; lane < loop.lanes_in(group); ++lane)
                any |= fine[loop.element(group, lane)] != 0.0;
            slots_.push_back(slots_.back() + (any ? fine_ : coarse_));
        }
    }

    bool any_fine() const { return !first_.empty(); }
    bool is_fine(Index element) const { return count(element) == fine_; }
    bool any_fine_in(Index group) const { return slots(group) == fine_; }

    Index n_points() const { return any_fine() ? first_.back() : n_elements_ * coarse_; }
    /// Returns the number of an element's first point, and of its points, which follow each other.
    Index first(Index element) const { return any_fine() ? first_[element] : element * coarse_; }
    int count(Index element) const { return any_fine() ? first_[element + 1] - first_[element] : coarse_; }

    Index n_slots() const { return any_fine() ? slots_.back() : groups_ * coarse_; }
    /// Returns the number of the first slot of a SIMD vector, and of its slots, which follow each other.
    Index first_slot(Index group) const { return any_fine() ? slots_[group] : group * coarse_; }
    int slots(Index group) const { return any_fine() ? slots_[group + 1] - slots_[group] : coarse_; }

    /// Returns the field in every slot, from samples at all points; a uniform field [T] is added. Order as in
    /// AppliedField::add_samples.
    template <class Loop>
    std::vector<FieldAtPoint> in_slots(const Loop& loop, const FieldSamples& samples, int order,
                                       const Vec3& everywhere) const {
        std::vector<FieldAtPoint> fields(n_slots());  // zero
        for (Index group = 0; group < groups_; ++group)
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const Index e = loop.element(group, lane);
                for (int p = 0; p < count(e); ++p)
                    set_field(fields[first_slot(group) + p], lane, samples, first(e) + p, order, everywhere);
            }
        return fields;
    }

    std::size_t bytes() const { return bytes_of(first_) + bytes_of(slots_); }

  private:
    const Index n_elements_, groups_;
    const int coarse_, fine_;
    std::vector<Index> first_, slots_;  // and the number of all; empty if no element samples finely
};

}  // namespace magshell
