// What makes an elastic term viscous: a stress that knows where the strain has been.
//
//   sigma = C (scale d - shift)
//
// covers every linear law that is integrated implicitly in time; solve/viscosity.h has those that are used.
#pragma once

#include <vector>

#include "magshell/assembly/lanes.h"

namespace magshell {

/// Three numbers a face, in the layout of packs: strain i of pack p at 3 p + i, one lane a face.
using Strains = std::vector<Pack>;

/// Of a whole sheet; a vector space.
struct SheetStrains {
    Strains membrane, bending;

    bool empty() const { return membrane.empty(); }
    void add(double factor, const SheetStrains& other) {
        add(membrane, factor, other.membrane);
        add(bending, factor, other.bending);
    }
    SheetStrains times(double factor) const {
        SheetStrains product;
        product.add(factor, *this);
        return product;
    }
    /// The sum over the faces.
    double dot(const SheetStrains& other, Index faces) const {
        return dot(membrane, other.membrane, faces) + dot(bending, other.bending, faces);
    }

  private:
    static void add(Strains& sum, double factor, const Strains& part) {
        if (sum.empty()) sum.assign(part.size(), Pack(0.0));
        for (std::size_t k = 0; k < part.size(); ++k) sum[k] += Pack(factor) * part[k];
    }
    static double dot(const Strains& a, const Strains& b, Index faces) {
        double sum = 0.0;
        for (Index f = 0; f < faces; ++f)
            for (int i = 0; i < 3; ++i)
                sum += a[3 * (f / Pack::width) + i][f % Pack::width] *
                       b[3 * (f / Pack::width) + i][f % Pack::width];
        return sum;
    }
};

struct StrainHistory {
    double scale = 1.0;
    const Strains* shift = nullptr;

    /// From d to scale d - shift.
    void apply(Index pack, Pack strain[3]) const {
        if (!shift) return;
        for (int i = 0; i < 3; ++i) strain[i] = Pack(scale) * strain[i] - (*shift)[3 * pack + i];
    }

    /// scale C.
    Symmetric3 scaled(const Symmetric3& stiffness) const {
        Symmetric3 result = stiffness;
        if (shift)
            for (Pack& entry : result.at) entry *= Pack(scale);
        return result;
    }
};

/// A term of elastic energy, 1/2 d^T C d, whose strains have three numbers a face.
class ElasticTerm : public Term {
  public:
    /// From now on; an empty history makes the term elastic again.
    void set_history(const StrainHistory& history) { history_ = history; }

    /// d at q.
    virtual void strains(const double* q, Strains& out) = 0;
    /// J p at the last evaluated state.
    virtual void strain_rates(const double* p, Strains& out) = 0;
    /// C d, without history.
    virtual void stresses(const Strains& strains, Strains& out) const = 0;
    /// Adds J^T s at the last evaluated state.
    virtual void add_forces(const Strains& stresses, Residual& out) = 0;

  protected:
    StrainHistory history_;
};

}  // namespace magshell
