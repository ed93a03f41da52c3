// Where a load step leads beyond its tangent: the path of states is bent, and thin sheets that go along the tangent stretch.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// The polynomial of third order through the last two states of a path with their tangents (Hermite's).
class LoadPredictor {
  public:
    /// coordinates: how many of the unknowns are lengths.
    explicit LoadPredictor(Index coordinates) : coordinates_(coordinates) {}

    /// A step was gone from a state, along this tangent times its size.
    void went(const VectorXd& from, const VectorXd& tangent, double step);
    /// What comes next has nothing to do with what was before.
    void forget() { before_.resize(0); }

    /// What is to be added to the tangent times the step that is tried from `here`: nothing where it is not small beside that.
    VectorXd bend(const VectorXd& here, const VectorXd& tangent, double step) const;

  private:
    const Index coordinates_;
    VectorXd before_, rate_;  // the state before, and its tangent by a whole step
    double step_ = 0.0;       // from there
};

}  // namespace magshell
