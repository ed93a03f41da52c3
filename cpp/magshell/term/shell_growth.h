// How a sheet's faces have grown and bent by themselves, and the gradient by it. Numbers that may change during a solve.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/core/types.h"

namespace magshell {

/// How the caller gives a tensor: one for all faces or one each (rows), as a factor of unity (width 1) or whole (9); no rows:
/// not at all.
struct TensorForm {
    Index rows = 0, width = 1;
};

struct GrowthForm {
    TensorForm growth, rest_curvature;
};

class ShellGrowth {
  public:
    /// `faces` has to outlive it.
    ShellGrowth(const std::string& owner, const Renumbering& faces, const GrowthForm& form,
                Registry& registry);

    bool any() const { return growth_.slot.rows > 0 || curvature_.slot.rows > 0; }
    /// Whether any has changed.
    bool set_values(const Values& values);

    /// In world axes; only what lies in the face is meant.
    Mat3 growth(Index face) const { return growth_.at(row(growth_, face), 1.0); }
    Mat3 curvature(Index face) const { return curvature_.at(row(curvature_, face), 0.0); }

    /// Adds derivatives by both tensors of a face.
    void add_vjp(Index face, const Mat3& by_growth, const Mat3& by_curvature, Gradient& out) const;

    std::size_t bytes() const {
        return (growth_.numbers.capacity() + curvature_.numbers.capacity()) * sizeof(double);
    }

  private:
    struct Tensors {
        Slot slot;
        std::vector<double> numbers;

        void add(const std::string& owner, const char* name, const char* unit, const TensorForm& form,
                 Registry& registry);
        bool take(const Values& values);
        Mat3 at(Index row, double without) const;
        void add_gradient(Index row, const Mat3& by, Gradient& out) const;
    };

    Index row(const Tensors& of, Index face) const { return of.slot.rows > 1 ? faces_.user[face] : 0; }

    const Renumbering& faces_;
    Tensors growth_, curvature_;
};

}  // namespace magshell
