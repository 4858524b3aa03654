#include "palanquin/solvers/unboundedness.hpp"

#include <algorithm>

namespace palanquin {

void UnboundednessTest::reset(double start_size) {
  start_size_ = std::max(1.0, start_size);
  last_decrease_ = 0.0;
  count_ = 0;
}

bool UnboundednessTest::update(double before, double after, double size, double limit) {
  constexpr double kAsMuch = 0.5;  // of the decrease before: less of it is progress
  constexpr int kSteps = 3;
  const double decrease = before - after;
  const bool falls_on = decrease > 0.0 && decrease >= kAsMuch * last_decrease_;
  count_ = falls_on && size > limit * start_size_ ? count_ + 1 : 0;
  last_decrease_ = decrease;
  return count_ >= kSteps;
}

}  // namespace palanquin
