// ShellGrowth: the growth tensor and the natural curvature of a shell's faces, and the gradients with respect to them. Both
// may change during a solve.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/core/types.h"

namespace magshell {

/// The layout in which the caller gives a tensor: `rows` is 1 for all faces or one per face, 0 if it is not
/// given; `width` is 1 for a multiple of the identity or 9 for a full tensor.
struct TensorForm {
    Index rows = 0, width = 1;
};

struct GrowthForm {
    TensorForm growth, rest_curvature;
};

class ShellGrowth {
  public:
    /// Stores a reference to `faces`, which must outlive the object.
    ShellGrowth(const std::string& owner, const Renumbering& faces, const GrowthForm& form,
                Registry& registry);

    bool any() const { return growth_.slice.rows > 0 || curvature_.slice.rows > 0; }
    /// Reads the tensors; returns true if any has changed.
    bool set_values(const Values& values);

    /// Return the tensors of a face in world axes; only their components in the plane of the face matter.
    Mat3 growth(Index face) const { return growth_.at(row(growth_, face), 1.0); }
    Mat3 curvature(Index face) const { return curvature_.at(row(curvature_, face), 0.0); }

    /// Adds the gradient with respect to both tensors of a face.
    void add_vjp(Index face, const Mat3& by_growth, const Mat3& by_curvature, Gradient& out) const;

    std::size_t bytes() const {
        return (growth_.numbers.capacity() + curvature_.numbers.capacity()) * sizeof(double);
    }

  private:
    struct Tensors {
        ParameterSlice slice;
        std::vector<double> numbers;

        void add(const std::string& owner, const char* name, const char* unit, const TensorForm& form,
                 Registry& registry);
        bool take(const Values& values);
        Mat3 at(Index row, double without) const;
        void add_gradient(Index row, const Mat3& by, Gradient& out) const;
    };

    Index row(const Tensors& of, Index face) const { return of.slice.rows > 1 ? faces_.user[face] : 0; }

    const Renumbering& faces_;
    Tensors growth_, curvature_;
};

}  // namespace magshell
