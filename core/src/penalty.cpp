#include "palanquin/core/penalty.hpp"

#include <cmath>
#include <limits>
#include <sstream>

namespace palanquin {
namespace {

// Every branch is entered by a comparison that NaN fails, so that NaN reaches the last one and
// propagates instead of passing for an inactive row.

PenaltyValue c2_penalty(double k, double eps, double h) {
  if (h <= -eps) return {};
  if (h >= eps) return {k * (h * h + eps * eps / 3.0), 2.0 * k * h, 2.0 * k};
  const double t = h / eps;
  return {k * eps * eps * (t * t * t / 6.0 + t * t / 2.0 + t / 2.0 + 1.0 / 6.0),
          k * eps * (t * t / 2.0 + t + 0.5), k * (t + 1.0)};
}

PenaltyValue squared_hinge(double k, double h) {
  if (h <= 0.0) return {};
  return {k * h * h, 2.0 * k * h, 2.0 * k};
}

PenaltyValue relaxed_barrier(double mu, double delta, double h) {
  if (h <= -delta) return {-mu * std::log(-h), -mu / h, mu / (h * h)};
  const double t = (h + delta) / delta;
  return {mu * (t + 0.5 * t * t - std::log(delta)), mu / delta * (1.0 + t), mu / (delta * delta)};
}

}  // namespace

double vanishes_until(const Policy& policy) {
  switch (policy.kind) {
    case PolicyKind::Hard:
      return std::numeric_limits<double>::infinity();
    case PolicyKind::C2Penalty:
      return -policy.smoothing;
    case PolicyKind::SquaredHinge:
      return 0.0;
    case PolicyKind::RelaxedBarrier:
      break;
  }
  return -std::numeric_limits<double>::infinity();
}

PenaltyValue evaluate_penalty(const Policy& policy, double h) {
  switch (policy.kind) {
    case PolicyKind::Hard:
      return {};
    case PolicyKind::C2Penalty:
      return c2_penalty(policy.stiffness, policy.smoothing, h);
    case PolicyKind::SquaredHinge:
      return squared_hinge(policy.stiffness, h);
    case PolicyKind::RelaxedBarrier:
      return relaxed_barrier(policy.stiffness, policy.smoothing, h);
  }
  return {};
}

std::string Policy::explain_invalid() const {
  std::ostringstream sentence;
  const int number = static_cast<int>(kind);
  if (number < 0 || number > static_cast<int>(PolicyKind::RelaxedBarrier))
    sentence << "kind is " << number << ", but must be 0 (hard) to 3 (relaxed barrier)";
  else if (kind == PolicyKind::Hard)
    return {};
  else if (!std::isfinite(stiffness) || stiffness < 0.0)
    sentence << "stiffness is " << stiffness << ", but must be finite and not negative";
  else if (kind != PolicyKind::SquaredHinge && (!std::isfinite(smoothing) || smoothing <= 0.0))
    sentence << "smoothing is " << smoothing << ", but must be finite and positive";
  return sentence.str();
}

}  // namespace palanquin
