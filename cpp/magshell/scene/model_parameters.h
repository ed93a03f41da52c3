// ModelParameters: the parameters of a scene: their layout, their values, and derivatives with respect to them.
#pragma once

#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/dofs/dof_map.h"
#include "magshell/scene/scene_terms.h"

namespace magshell {

// Parameters that change during a solve, such as the position of a magnet over the time of a motion.
//
// During such a solve they are load parameters: their numbers are appended to the registered ones in every vector of load parameters.
class TimeVaryingParameters {
  public:
    TimeVaryingParameters() = default;
    /// entries: indices of registered values, each once. Throws InvalidInput if one cannot vary.
    TimeVaryingParameters(const Registry& registry, const std::vector<Index>& entries);

    bool empty() const { return slices_.empty(); }
    /// Returns the total number of components.
    Index size() const { return size_; }

    /// Copies the numbers from load parameters into the vector of all values. Returns true if any of them changed.
    bool update(const LoadParameters& load_parameters, VectorXd& values) const;
    /// Moves the gradient with respect to these values to the gradient with respect to load parameters.
    void move_gradient(Gradient& gradient) const;

  private:
    std::vector<ParameterSlice> slices_;  // positions among the values
    Index first_ = 0, size_ = 0;
};

class ModelParameters {
  public:
    /// The references must outlive it.
    ModelParameters(const Registry& registry, const Bodies& bodies, DofMap& dof_map, SceneTerms& terms);
    ModelParameters(const ModelParameters&) = delete;
    ModelParameters& operator=(const ModelParameters&) = delete;

    /// Lists the parameters (values) and load parameters that the terms read.
    const Registry& registry() const { return registry_; }
    LoadParameters zero_load_parameters() const;

    /// Sets all parameters, in the row order of the caller; required once before a solve.
    void set_values(const VectorXd& in_user_order);
    /// Lets some parameters vary with the load parameters from now on. With none, those that varied return to their former values.
    void vary(TimeVaryingParameters time_varying);
    const TimeVaryingParameters& time_varying() const { return varying_; }
    /// Applies the varying parameters at these load parameters to the next evaluations.
    void set_time_varying(const LoadParameters& load_parameters);
    /// Returns a counter of parameter changes, and one of those that change the forces which cancel within the strains.
    int version() const { return version_; }
    int cancelling_version() const { return cancelling_version_; }
    /// Returns the smallest length scale of the terms: the thickness of the thinnest shell [m].
    double length_scale() const { return length_scale_; }

    /// Adds lambda . dg/dk at the last evaluated state for all parameters k except those of supports; lambda is zero where nodes are
    /// prescribed.
    void vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda,
             Gradient& out) const;
    /// Adds - lambda . df/dk of the forces f to the gradient; returns the gradient of lambda . f by the kinematics.
    KinematicsGradient forces_vjp(const Kinematics& at, const LoadParameters& load_parameters,
                                  const VectorXd& lambda, Gradient& out) const;
    /// Adds the gradient of lambda . p of the momentum p(q, v) that forces carry.
    void momentum_vjp(const VectorXd& q, const VectorXd& v, const VectorXd& lambda, VectorXd& by_q,
                      VectorXd& by_v, Gradient& out) const;
    /// Adds the gradient of a function of the strain rates of joint dampers at q for velocities v.
    void damper_rates_vjp(const VectorXd& q, const VectorXd& v, const StrainSet& by_rates, VectorXd& by_q,
                          VectorXd& by_v, Gradient& out) const;
    /// Returns the derivative of the gradient at q along the load path: load parameters `at`, changing at `rate`. It is exact for those
    /// that enter linearly, and by fourth-order differences for varying parameters. Leaves the terms evaluated elsewhere.
    VectorXd gradient_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate);
    /// Returns the derivative of the prescribed positions in the same way; zero for all other dofs.
    VectorXd prescribed_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate);

  private:
    void distribute_values();
    template <class Function>
    VectorXd rate_by_varying(const LoadParameters& at, const LoadParameters& rate, const Function& function);

    const Registry& registry_;
    const Bodies& bodies_;
    DofMap& dof_map_;
    SceneTerms& terms_;
    Values values_;
    TimeVaryingParameters varying_;
    VectorXd base_values_;  // the parameters before any of them varied
    int version_ = 0, cancelling_version_ = 0;
    double length_scale_ = 0.0;
};

/// RAII guard that lets parameters vary until the end of its scope.
class ScopedTimeVarying {
  public:
    ScopedTimeVarying(ModelParameters& parameters, const TimeVaryingParameters& time_varying)
        : parameters_(parameters), varies_(!time_varying.empty()) {
        if (varies_) parameters_.vary(time_varying);
    }
    ~ScopedTimeVarying() {
        if (varies_) parameters_.vary({});
    }
    ScopedTimeVarying(const ScopedTimeVarying&) = delete;
    ScopedTimeVarying& operator=(const ScopedTimeVarying&) = delete;

  private:
    ModelParameters& parameters_;
    bool varies_;
};

}  // namespace magshell
