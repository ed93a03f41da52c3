// Linear viscoelasticity of the strains d of a shell or solid, integrated by the stages of a step:
//
//   sigma = C (d + beta d' + g (d - e)),   e' = (d - e)/tau
//
// beta [s]: stiffness-proportional damping (Kelvin-Voigt), for small motions the matrix beta K. g [-] and tau [s]: modulus of a
// Maxwell branch relative to the elastic one, and its relaxation time. With T = a dt, r = T/tau, and ^ for the start of a stage,
//
//   d'_i = (d_i - d^_i)/T,   e_i = (e^_i + r d_i)/(1 + r),
//   sigma_i = C (scale d_i - shift_i),  scale = 1 + beta/T + g/(1 + r),  shift_i = beta/T d^_i + g/(1 + r) e^_i
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

struct Viscosity {
    double stiffness_damping = 0.0;                    // beta [s]
    double maxwell_modulus = 0.0, maxwell_time = 1.0;  // g [-], tau [s]
    double elastic = 1.0;                              // factor of the elastic stress; 0: none

    bool any() const { return stiffness_damping != 0.0 || maxwell(); }
    bool maxwell() const { return maxwell_modulus != 0.0; }
    double ratio(double stage_time) const { return stage_time / maxwell_time; }
    double relaxed(double stage_time) const { return maxwell_modulus / (1.0 + ratio(stage_time)); }
    double scale(double stage_time) const {
        return elastic + stiffness_damping / stage_time + relaxed(stage_time);
    }
};

/// The law of joint dampers, which have a viscous stress only.
inline constexpr Viscosity damper_law{1.0, 0.0, 1.0, 0.0};

/// Rates of the strains and of the Maxwell strains at a stage.
struct StrainRates {
    StrainSet d, e;
};

/// Rates at a stage: of positions, velocities, elastic strains, and strains of joint dampers. If contact is implicit (tableau.h), w is the
/// acceleration without contact, and c that of contact and friction; else c is empty.
struct StageRates {
    VectorXd v, w, c = {};
    StrainRates elastic, joints;

    bool empty() const { return v.size() == 0; }
};

/// The strains of one stage: at its start (d_hat, e_hat), the history of the stress (shift), and at its solution (d, e).
struct ViscousStage {
    StrainSet d_hat, e_hat, shift;
    StrainSet d, e;

    ViscousStage() = default;
    /// Computes the start of a stage from the strains at the beginning of the step and all rates of one kind before it.
    using Kind = StrainRates StageRates::*;
    ViscousStage(const Viscosity& law, double stage_time, double dt, const double* a,
                 const std::vector<StageRates>& rates, Kind kind, const StrainSet& d_begin,
                 const StrainSet& e_begin);
    /// Computes the strains and their rates once the stage is solved.
    void finish(const Viscosity& law, double stage_time, StrainSet strains, StrainRates& rates);
};

/// RAII guard that makes terms elastic again, without a strain history, at the end of its scope.
class ScopedStrainHistory {
  public:
    explicit ScopedStrainHistory(Model& model) : model_(model) {}
    ~ScopedStrainHistory() {
        model_.elastic().set_history(1.0, nullptr);
        model_.dampers().set_history(1.0, nullptr);
    }

  private:
    Model& model_;
};

}  // namespace magshell
