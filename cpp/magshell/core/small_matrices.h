// Sums, multiples and products of vectors and matrices of up to 3 x 3 numbers, as values.
//
// Eigen's own operators return a description of what is to be computed (an expression), whose type contains those of the
// operands. It saves temporaries in long vectors, but a compiler keeps three numbers in registers anyway, and each of these
// types costs it some twenty classes: they took a tenth of the time to compile the core. The operators below are exact
// matches, so they are preferred to Eigen's wherever names of magshell are looked up. What Eigen evaluates for them, such as
// a column, a row, a Map or a transposed matrix, becomes a value first. Products add in Eigen's order, a0 b0 + (a1 b1 + a2 b2).
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <type_traits>

namespace magshell {

/// A matrix of R x C numbers; Eigen wants rows to be stored by rows.
template <int R, int C>
using SmallMatrix = Eigen::Matrix<double, R, C, R == 1 ? Eigen::RowMajor : Eigen::ColMajor>;

/// Anything of Eigen's that evaluates to a matrix or vector of up to 3 x 3 numbers.
template <class T>
concept MakesSmallMatrix =
    requires { typename T::PlainObject; } && T::RowsAtCompileTime >= 1 && T::RowsAtCompileTime <= 3 &&
    T::ColsAtCompileTime >= 1 && T::ColsAtCompileTime <= 3 && T::SizeAtCompileTime > 1 &&
    std::same_as<typename T::PlainObject,
                 Eigen::Matrix<double, T::RowsAtCompileTime, T::ColsAtCompileTime, T::PlainObject::Options>>;

/// The matrix to which it evaluates.
template <MakesSmallMatrix T>
using SmallValue = SmallMatrix<T::RowsAtCompileTime, T::ColsAtCompileTime>;

template <class T, class U>
concept HasShapeOf = MakesSmallMatrix<T> && std::same_as<SmallValue<T>, SmallValue<U>>;

/// Something that can be multiplied by a matrix of type U from the left, other than to a scalar.
template <class T, class U>
concept CanFollow = MakesSmallMatrix<T> && int(U::ColsAtCompileTime) == int(T::RowsAtCompileTime) &&
                    U::RowsAtCompileTime * T::ColsAtCompileTime > 1;

template <class S>
concept PlainNumber = std::is_arithmetic_v<S>;

template <MakesSmallMatrix A, HasShapeOf<A> B>
SmallValue<A> operator+(const A& a, const B& b) {
    const SmallValue<A>&x = a, &y = b;
    SmallValue<A> sum;
    for (int k = 0; k < sum.size(); ++k) sum.data()[k] = x.data()[k] + y.data()[k];
    return sum;
}

template <MakesSmallMatrix A, HasShapeOf<A> B>
SmallValue<A> operator-(const A& a, const B& b) {
    const SmallValue<A>&x = a, &y = b;
    SmallValue<A> difference;
    for (int k = 0; k < x.size(); ++k) difference.data()[k] = x.data()[k] - y.data()[k];
    return difference;
}

template <MakesSmallMatrix A>
SmallValue<A> operator-(const A& a) {
    const SmallValue<A>& x = a;
    SmallValue<A> negative;
    for (int k = 0; k < x.size(); ++k) negative.data()[k] = -x.data()[k];
    return negative;
}

template <MakesSmallMatrix A>
SmallValue<A> operator*(PlainNumber auto factor, const A& a) {
    const SmallValue<A>& x = a;
    const double s = factor;
    SmallValue<A> multiple;
    for (int k = 0; k < x.size(); ++k) multiple.data()[k] = s * x.data()[k];
    return multiple;
}

template <MakesSmallMatrix A>
SmallValue<A> operator*(const A& a, PlainNumber auto factor) {
    return factor * a;
}

template <MakesSmallMatrix A>
SmallValue<A> operator/(const A& a, PlainNumber auto divisor) {
    const SmallValue<A>& x = a;
    const double s = divisor;
    SmallValue<A> quotient;
    for (int k = 0; k < x.size(); ++k) quotient.data()[k] = x.data()[k] / s;
    return quotient;
}

template <MakesSmallMatrix A, CanFollow<A> B>
SmallMatrix<A::RowsAtCompileTime, B::ColsAtCompileTime> operator*(const A& a, const B& b) {
    constexpr int rows = A::RowsAtCompileTime, inner = A::ColsAtCompileTime, cols = B::ColsAtCompileTime;
    const SmallValue<A>& x = a;
    const SmallValue<B>& y = b;
    SmallMatrix<rows, cols> product;
    for (int j = 0; j < cols; ++j)
        for (int i = 0; i < rows; ++i) {
            const double first = x(i, 0) * y(0, j);
            if constexpr (inner == 1)
                product(i, j) = first;
            else if constexpr (inner == 2)
                product(i, j) = first + x(i, 1) * y(1, j);
            else
                product(i, j) = first + (x(i, 1) * y(1, j) + x(i, 2) * y(2, j));
        }
    return product;
}

}  // namespace magshell
