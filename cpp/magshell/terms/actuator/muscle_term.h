// MuscleTerm: a muscle in a solid. It consists of the energy of its fibres (energy/fibre.h) and, with a
// force-velocity curve, of a force that depends on their rates (muscle_rate_term.h).
#pragma once

#include <memory>

#include "magshell/terms/actuator/muscle_fibres.h"
#include "magshell/terms/force_term.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/stress_rate_term.h"
#include "magshell/terms/term.h"

namespace magshell {

/// The state of a muscle at each integration point, element by element in the caller's order.
struct FibreStates {
    int points = 1;                 // per element
    std::vector<double> stretches;  // |F m|
    std::vector<double> tensions;   // [Pa] per reference area across the fibre
    std::vector<double> volumes;    // reference volumes [m3]
};

class MuscleTerm : public Term, public RestShapeTerm, public StressRateTerm {
  public:
    std::string_view name() const final { return "muscle"; }
    /// Returns stretches and tensions at q. v: velocities of all degrees of freedom [m/s]; nullptr at rest.
    virtual FibreStates states(const double* q, const double* v) const = 0;
};

struct Muscle {
    std::unique_ptr<MuscleTerm> term;
    std::unique_ptr<ForceTerm> force;  // nullptr without a force-velocity curve
};

/// Creates a muscle. body: index of the fibres among the bodies that have blocks. The references must outlive
/// it.
Muscle make_muscle(const MuscleInput& input, const Fibres& fibres, Index body,
                   const ColoredLoop& element_blocks, const SystemMatrix& matrix, Registry& registry);

}  // namespace magshell
