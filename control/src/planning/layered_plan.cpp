#include "palanquin/control/planning/layered_plan.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin::planning {

void LayeredPlan::shift(double elapsed) {
  const int n = horizon();
  const int steps = static_cast<int>(std::min<double>(std::nearbyint(elapsed / dt), n));
  time += elapsed;
  for (int k = 0; k <= n; ++k) states.row(k) = states.row(std::min(k + steps, n)).eval();
  for (int k = 0; k < n; ++k) {
    inputs.row(k) = inputs.row(std::min(k + steps, n - 1)).eval();
    bars.row(k) = bars.row(std::min(k + steps, n - 1)).eval();
  }
}

void LayeredPlan::lift_feet(const Flags& contacts) {
  for (int k = 0; k < horizon(); ++k)
    for (int i = 0; i < kFeet * robots(); ++i)
      if (!contacts(k, i)) point(inputs, k, i).setZero();
}

}  // namespace palanquin::planning
