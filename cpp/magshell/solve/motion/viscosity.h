// Linear viscoelasticity of the strains d of a shell or solid, integrated by the stages of a step:
//
//   sigma = C (d + beta d' + sum_k g_k (d - e_k)),   e_k' = (d - e_k)/tau_k
//
// beta [s]: stiffness-proportional damping (Kelvin-Voigt), for small motions the matrix beta K. g_k [-] and tau_k [s]: modulus of the
// k-th Maxwell branch relative to the elastic one, and its relaxation time; several branches are a Prony series. With T = a dt,
// r_k = T/tau_k, and ^ for the start of a stage,
//
//   d'_i = (d_i - d^_i)/T,   e_ki = (e^_ki + r_k d_i)/(1 + r_k),   sigma_i = C (scale d_i - shift_i),
//   scale = 1 + beta/T + sum_k g_k/(1 + r_k),   shift_i = beta/T d^_i + sum_k g_k/(1 + r_k) e^_ki
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

struct MaxwellBranch {
    double modulus = 0.0, time = 1.0;  // g [-], tau [s]

    double ratio(double stage_time) const { return stage_time / time; }
    double relaxed(double stage_time) const { return modulus / (1.0 + ratio(stage_time)); }
};

/// The Maxwell strains e of all branches, one after another; empty without a branch.
using MaxwellStrains = std::vector<StrainSet>;

struct Viscosity {
    double stiffness_damping = 0.0;       // beta [s]
    std::vector<MaxwellBranch> branches;  // moduli may be zero, of which gradients are computed as well
    double elastic = 1.0;                 // factor of the elastic stress; 0: none
    bool damping_varies = false;          // the gradient with respect to a damping of zero is wanted

    bool any() const { return stiffness_damping != 0.0 || damping_varies || maxwell(); }
    bool maxwell() const { return !branches.empty(); }
    double scale(double stage_time) const {
        double scale = elastic + stiffness_damping / stage_time;
        for (const MaxwellBranch& branch : branches) scale += branch.relaxed(stage_time);
        return scale;
    }
};

/// The law of joint dampers, which have a viscous stress only.
inline const Viscosity damper_law{1.0, {}, 0.0};

/// Rates of the strains and of the Maxwell strains at a stage.
struct StrainRates {
    StrainSet d;
    MaxwellStrains e;
};

/// Rates at a stage: of positions, velocities, elastic strains, and strains of joint dampers. If contact is implicit (tableau.h), the
/// acceleration is that without contact, and c that by contact and friction; else c is empty. momentum_rate: of the momentum that
/// forces carry [N]; empty without it.
struct StageRates {
    VectorXd v, acceleration, c = {}, momentum_rate = {};
    StrainRates elastic, joints;

    bool empty() const { return v.size() == 0; }
};

/// The strains of one stage: at its start (d_hat, e_hat), the history of the stress (shift), and at its solution (d, e).
struct ViscousStage {
    StrainSet d_hat, shift, d;
    MaxwellStrains e_hat, e;

    ViscousStage() = default;
    /// Computes the start of a stage from the strains at the beginning of the step and all rates of one kind before it.
    using Kind = StrainRates StageRates::*;
    ViscousStage(const Viscosity& law, double stage_time, double dt, const double* a,
                 const std::vector<StageRates>& rates, Kind kind, const StrainSet& d_begin,
                 const MaxwellStrains& e_begin);
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
