// Terms that couple all of their nodes with each other: what of their Hessian is of low rank is kept beside the matrix.
#pragma once

#include "magshell/assembly/low_rank.h"
#include "magshell/term/term.h"

namespace magshell {

class LowRankTerm : public Term {
  public:
    /// Adds that of the Hessian at the last evaluated state.
    virtual void add_low_rank(const Controls& controls, LowRank& out) const = 0;

    /// Adds the magnitude of forces that cancel at the last evaluated state.
    virtual void add_cancelling_here(VectorXd& out) const = 0;

    /// Whether what it assembles from now on is curved as its extrapolated pressures or tensions have it: in mixed steps
    /// these are unknowns of their own, condensed, which what is stiff needs.
    /// Cautious: a state's own pressure says nothing where what is stiff is not yet as it should be; it is left out.
    void take_extrapolated(bool extrapolated, bool convexified) {
        extrapolated_ = extrapolated;
        convexified_ = convexified && !extrapolated;
    }

  protected:
    bool extrapolated_ = false, convexified_ = false;
};

}  // namespace magshell
