// temporary dev stub until linalg lands
#include "magshell/linalg/factor.h"
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
namespace magshell { namespace {
struct S : Factor { Eigen::SparseMatrix<double> a; Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> f; SparsePattern p;
 S(const SparsePattern& q):p(q){ a.resize(p.size,p.size); std::vector<Eigen::Triplet<double>> t; for(int j=0;j<p.size;++j) for(int k=p.column_starts[j];k<p.column_starts[j+1];++k) t.emplace_back(p.rows[k],j,1.0); a.setFromTriplets(t.begin(),t.end()); f.analyzePattern(a);}
 FactorReport factorize(const double* v) override { std::copy(v,v+a.nonZeros(),a.valuePtr()); f.factorize(a); FactorReport r; r.succeeded=f.info()==Eigen::Success; if(!r.succeeded) {r.reason="zero pivot";return r;} r.negative_pivots=(f.vectorD().array()<0).count(); return r;}
 void solve(Eigen::Ref<Eigen::MatrixXd> b) const override { b=f.solve(b).eval(); }
 std::string name() const override {return "eigen stub";} Index size() const override {return p.size;} std::int64_t nonzeros() const override {return 0;} double flops() const override {return 0;} std::size_t bytes() const override {return 0;}
};}
std::unique_ptr<Factor> analyze(const SparsePattern& p, const FactorOptions&) { return std::make_unique<S>(p);}
}
