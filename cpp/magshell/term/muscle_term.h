// A muscle in a solid: the energy of its fibres, and the force beside it that depends on how fast they change.
//                                                                                                        energy/fibre.h
#pragma once

#include <memory>

#include "magshell/term/force_term.h"
#include "magshell/term/muscle_fibres.h"
#include "magshell/term/term.h"

namespace magshell {

/// At each point of integration of each element, one element after another in the caller's order.
struct FibreStates {
    int points = 1;                 // an element
    std::vector<double> stretches;  // |F m|
    std::vector<double> tensions;   // [Pa] a rest area across the fibre
    std::vector<double> volumes;    // at rest [m3]
};

class MuscleTerm : public Term {
  public:
    std::string_view name() const final { return "muscle"; }
    /// v: velocities of all unknowns [m/s], or nullptr where nothing moves.
    virtual FibreStates states(const double* q, const double* v) const = 0;
};

struct Muscle {
    std::unique_ptr<MuscleTerm> term;
    std::unique_ptr<ForceTerm> force;  // nullptr: none
};

/// `body`: of the fibres, among those that have chunks. They have to outlive it.
Muscle make_muscle(const MuscleInput& input, const Fibres& fibres, Index body, const ChunkLoop& chunks,
                   const SystemMatrix& matrix, Registry& registry);

}  // namespace magshell
