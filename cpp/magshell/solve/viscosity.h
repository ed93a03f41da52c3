// Linear viscoelasticity of the sheet's strains d, integrated by the stages of a step.
//
//   sigma = C (d + beta d' + g (d - e)),   e' = (d - e)/tau
//
// beta [s]: stiffness-proportional damping (Kelvin-Voigt); for small motions the matrix beta K. g and tau
// [s]: the modulus of a Maxwell branch beside the elastic one, and its relaxation time. With T = a dt and r = T/tau,
//
//   d'_i = (d_i - d^_i)/T,   e_i = (e^_i + r d_i)/(1 + r),
//   sigma_i = C (scale d_i - shift_i),  scale = 1 + beta/T + g/(1 + r),  shift_i = beta/T d^_i + g/(1 + r)
//   e^_i
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

struct Viscosity {
    double stiffness_damping = 0.0;                    // beta [s]
    double maxwell_modulus = 0.0, maxwell_time = 1.0;  // g, over the elastic one; tau [s]
    double elastic = 1.0;                              // 0: there is no stress at rest

    bool any() const { return stiffness_damping != 0.0 || maxwell(); }
    bool maxwell() const { return maxwell_modulus != 0.0; }
    double ratio(double stage_time) const { return stage_time / maxwell_time; }
    double relaxed(double stage_time) const { return maxwell_modulus / (1.0 + ratio(stage_time)); }
    double scale(double stage_time) const {
        return elastic + stiffness_damping / stage_time + relaxed(stage_time);
    }
};

/// Dampers in joints: their strains have no other stress.
inline constexpr Viscosity damper_law{1.0, 0.0, 1.0, 0.0};

/// How fast strains change in a stage, and those of the Maxwell branch.
struct StrainRates {
    StrainSet d, e;
};

/// How fast things change in a stage: positions, velocities, strains, and what dampers in joints feel.
struct StageRates {
    VectorXd v, w;
    StrainRates elastic, joints;

    bool empty() const { return v.size() == 0; }
};

/// The strains of one stage: what it starts from, and what comes out.
struct ViscousStage {
    StrainSet d_hat, e_hat, shift;
    StrainSet d, e;

    ViscousStage() = default;
    /// From the strains at the beginning of the step and all rates until then, those of one kind.
    using Kind = StrainRates StageRates::*;
    ViscousStage(const Viscosity& law, double stage_time, double dt, const double* a,
                 const std::vector<StageRates>& rates, Kind kind, const StrainSet& d_begin,
                 const StrainSet& e_begin);
    /// Once the stage is solved: the rates of its strains too.
    void finish(const Viscosity& law, double stage_time, StrainSet strains, StrainRates& rates);
};

/// Elastic again when it goes.
class ElasticAfterwards {
  public:
    explicit ElasticAfterwards(Model& model) : model_(model) {}
    ~ElasticAfterwards() {
        model_.elastic().set_history(1.0, nullptr);
        model_.dampers().set_history(1.0, nullptr);
    }

  private:
    Model& model_;
};

}  // namespace magshell
