// What the motors of joints do at the end of a time step.
//
// Along a prescribed path the acceleration w of a stage is of first order only; w_e through the velocities at three ends of
// steps is of second. What is stiff has been solved for with w, so it is of first order as well: it is solved for once more,
// with M (w_e - w) among the forces, and the motors hold against what acts there. In a first step there are but two ends, and
// nothing changes.
#pragma once

#include "magshell/solve/stepper.h"

namespace magshell {

/// Where the motors' forces are looked up at: next to the end of a step, which has just been solved for.
class DrivenEnd {
  public:
    /// q, anchor and last: of the last stage, at its end. Leaves the model evaluated here, its turns as they were.
    DrivenEnd(Newton& newton, const Inertia& inertia, const MotionState& begin, double dt, const VectorXd& q,
              const Controls& controls, const Anchor& anchor, const StageRates& last);

    const VectorXd& q() const { return q_; }
    /// It refers to this object.
    Anchor anchor() const { return {anchor_.weights, &target_, anchor_.motion}; }
    /// Whether the state was found.
    bool found() const { return found_; }
    /// w_e - w, empty in a first step; w_e = share_last v_last + share_begin v_begin + share_before v_before, in 1/s.
    const VectorXd& acceleration_change() const { return change_; }
    double share_last() const { return share_last_; }
    double share_begin() const { return share_begin_; }
    double share_before() const { return share_before_; }
    /// N and N m; NaN where the state was not found.
    VectorXd driving(const Controls& controls);

  private:
    bool find(const Controls& controls);

    Newton& newton_;
    Anchor anchor_;
    VectorXd q_, target_, change_;
    double share_last_ = 0.0, share_begin_ = 0.0, share_before_ = 0.0;
    bool found_ = true;
};

}  // namespace magshell
