#include <algorithm>
#include <cmath>

#include "structured/backward.hpp"

namespace palanquin::structured {
namespace {

/// The group's columns of G as a dense matrix [size x locals]: lower triangle of its own block, the
/// inputs and states that it meets, the gradient.
void gather(const Knot& knot, const LocalGroup& group, const int* slots, double* a) {
  for (int c = 0; c < group.locals; ++c) {
    const double* column = knot.storage + knot.plan.column_offset[slots[c]];
    for (int i = c; i < group.size(); ++i) a[i + c * group.size()] = column[slots[i]];
  }
}

/// [A; B] := [L; B L^{-T}] with 1 / L_kk on the diagonal.
bool factorize(const LocalGroup& group, double tolerance, double* a) {
  const int size = group.size();
  for (int c = 0; c < group.locals; ++c) {
    double* column = a + c * size;
    const double threshold = tolerance * std::abs(column[c]);
    for (int k = 0; k < c; ++k) {
      const double* before = a + k * size;
      for (int i = c; i < size; ++i) column[i] -= before[c] * before[i];
    }
    if (!(column[c] > threshold)) return false;
    column[c] = 1.0 / std::sqrt(column[c]);
    for (int i = c + 1; i < size; ++i) column[i] *= column[c];
  }
  return true;
}

/// G -= B A^{-1} B', lower triangle with the gradient's row. Feet have three coordinates: the
/// innermost loop of small groups is unrolled (`Locals` is their number, or 0 for any).
template <int Locals>
void subtract(const Knot& knot, const LocalGroup& group, const int* slots, const double* a) {
  const int locals = Locals > 0 ? Locals : group.locals;
  const int size = group.size();
  for (int j = locals; j < size - 1; ++j) {
    double* target = knot.storage + knot.plan.column_offset[slots[j]];
    for (int i = j; i < size; ++i) {
      double sum = 0.0;
      for (int c = 0; c < locals; ++c) sum += a[i + c * size] * a[j + c * size];
      target[slots[i]] -= sum;
    }
  }
}

}  // namespace

bool eliminate_locals(const Knot& knot, double pivot_tolerance) {
  for (const LocalGroup& group : knot.plan.groups) {
    const int* slots = knot.plan.group_slots.data() + group.first;
    double* a = knot.local_factor + group.factor_offset;
    gather(knot, group, slots, a);
    if (!factorize(group, pivot_tolerance, a)) return false;
    (group.locals == 3 ? subtract<3> : subtract<0>)(knot, group, slots, a);
  }
  return true;
}

}  // namespace palanquin::structured
