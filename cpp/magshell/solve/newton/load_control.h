// Chooses the size of load steps from the success of the previous ones, and predicts the curvature of the equilibrium path, since a thin
// shell that follows the tangent of the path only would be stretched.
#pragma once

#include <utility>

#include "magshell/solve/statics.h"

namespace magshell {

/// Controls the load step size (automatic incrementation). Steps are fractions of the whole load path, lengths fractions of the
/// extent of the scene.
class LoadStepController {
  public:
    /// stop_on_instability: steps are ended as soon as they leave the stable states; the displacement of their first iteration then
    /// says by how much they were too long.
    LoadStepController(double first, double longest, double smallest, double extent, bool stop_on_instability)
        : step_(first),
          smallest_(smallest * longest),
          longest_(longest),
          extent_(extent),
          stop_on_instability_(stop_on_instability),
          fixed_(smallest > StaticsOptions().smallest_step) {}

    /// Returns the size of the next step, given the part of the path that is left.
    double propose(double left);

    /// Reports that a step succeeded: a longer one follows.
    void accept(double step, const NewtonReport& report);
    /// Shortens the step after a failure. Returns false if shorter steps are not worth trying.
    bool reject(double step, const NewtonReport& report);

    /// Returns true if a failed step was so short that not its length is the cause but the end of the stable branch.
    bool is_short(const NewtonReport& report) const;
    /// Continues with this step size after a part of the path that was not taken by load steps.
    void reset_to(double step) { step_ = step; }

  private:
    double length_of(const NewtonReport& report) const { return report.first_length / extent_; }

    double step_, smallest_;
    const double longest_, extent_;
    const bool stop_on_instability_;
    const bool fixed_;  // the smallest step was given by the caller
    double failed_step_ = 2.0,
           failed_length_ = 0.0;  // the shortest step that failed, and the length of its first iteration
};

/// Cubic Hermite extrapolation of the path from its last two states and their tangents (Crisfield 9.5).
class LoadPredictor {
  public:
    /// coordinates: the number of dofs that are lengths; they come first.
    explicit LoadPredictor(Index coordinates) : coordinates_(coordinates) {}

    /// Records that a step was taken from a state, along this tangent times the step.
    void record(const VectorXd& from, const VectorXd& tangent, double step);
    /// Discards the history, because the next state is not on the same branch.
    void reset() { before_.resize(0); }

    /// Returns the displacement to add to the tangent of a step that is tried from `here`; empty if it is not small compared with it.
    VectorXd correction(const VectorXd& here, const VectorXd& tangent, double step) const;

  private:
    const Index coordinates_;
    VectorXd before_, rate_;  // the previous state, and its tangent per unit of the path
    double step_ = 0.0;       // taken from there
};

}  // namespace magshell
