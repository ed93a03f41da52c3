// AppliedField: the interface of every applied magnetic field: values and derivatives of the flux density at a
// batch of points.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Samples of the flux density at n points, with the derivatives that an energy m . B(x) needs. Fields are
/// added to it, so that several superpose.
struct FieldSamples {
    std::vector<Vec3> flux;       // B                                      [T]
    std::vector<Mat3> gradient;   // G_ij = dB_i/dx_j                       [T/m]             from order 1 on
    std::vector<Mat3> curvature;  // d2(m . B)/(dx_j dx_k), symmetric       [T/m2 unit of m]  order 2

    /// Sets everything to zero for this many points; what the order does not require is left empty.
    void reset(std::size_t points, int order);
};

/// Weights u, m and v at n points, which define one number of a field: sum u . B + m . (dB/dx v).
struct FieldProbe {
    std::vector<Vec3> flux;       // u
    std::vector<Vec3> moment;     // m
    std::vector<Vec3> direction;  // v
};

/// A parameter of a field: `rows` rows of `width` numbers.
struct FieldParameter {
    std::string_view name, unit;
    Index rows, width;
};

/// An applied flux density B(x).
class AppliedField {
  public:
    virtual ~AppliedField() = default;

    virtual std::string_view name() const = 0;

    /// Adds scale * B at the points [m] (order 0), its gradient (order 1), and its second derivative contracted
    /// with the moment of each point (order 2; no other order reads the moments). Where the field has no value,
    /// on a dipole or outside a grid, it adds NaN to everything. Must be called from one thread at a time.
    virtual void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                             double scale, FieldSamples& out) const = 0;

    /// Returns the parameters that a solve may change; none by default.
    virtual std::vector<FieldParameter> parameters() const { return {}; }
    /// Returns a copy with parameter values of its own, for a scene that changes them; nullptr if the field has
    /// no parameters.
    virtual std::shared_ptr<AppliedField> clone() const { return nullptr; }
    /// Sets all parameters, one after another, row by row.
    virtual void set_values(std::span<const double> /*values*/) {}

    /// Adds the gradient of a probe of scale * B by the parameters, in the layout of set_values.
    virtual void add_vjp(std::span<const Vec3> /*points*/, const FieldProbe&, double /*scale*/,
                         std::span<double> /*out*/) const {}

    /// Returns true if add_samples runs Python code. It then takes the GIL by itself.
    virtual bool needs_gil() const { return false; }
};

}  // namespace magshell
