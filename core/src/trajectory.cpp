#include "palanquin/core/trajectory.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

namespace {
Eigen::Map<const Vector4> quaternion_at(const double* z) { return Eigen::Map<const Vector4>(z); }
}  // namespace

RowMatrix neutral_trajectory(const LoweredProblem& problem, int horizon) {
  RowMatrix z = RowMatrix::Zero(horizon + 1, problem.nz());
  for (const BlockInfo& b : problem.blocks())
    if (b.is_quaternion) z.col(b.offset).setOnes();
  return z;
}

RowMatrix default_parameters(const LoweredProblem& problem, int horizon) {
  RowMatrix parameters(horizon + 1, problem.np());
  for (const ParameterInfo& p : problem.parameters())
    for (int i = 0; i < p.size; ++i)
      parameters.col(p.offset + i).setConstant(p.defaults[static_cast<std::size_t>(i)]);
  return parameters;
}

void retract(const LoweredProblem& problem, const double* z, const double* dz, double alpha,
             double* moved) {
  for (const VectorRun& run : problem.vector_runs())
    for (int i = 0; i < run.size; ++i)
      moved[run.offset + i] = z[run.offset + i] + alpha * dz[run.tangent_offset + i];
  for (const BlockInfo& b : problem.quaternions()) {
    const Eigen::Map<const Vector3> step(dz + b.tangent_offset);
    Eigen::Map<Vector4> result(moved + b.offset);
    result = quaternion_plus(quaternion_at(z + b.offset), alpha * step);
  }
}

void state_difference(const LoweredProblem& problem, const double* a, const double* b,
                      double* difference) {
  int row = 0;
  for (const BlockInfo& block : problem.states()) {
    if (block.is_quaternion) {
      Eigen::Map<Vector3> result(difference + row);
      result = quaternion_minus(quaternion_at(a + block.offset), quaternion_at(b + block.offset));
    } else {
      for (int i = 0; i < block.size; ++i)
        difference[row + i] = a[block.offset + i] - b[block.offset + i];
    }
    row += block.tangent_size;
  }
}

void shift(const LoweredProblem& problem, MatrixView trajectory, VectorView spacing, double elapsed,
           Eigen::Ref<RowMatrix> shifted) {
  if (!(std::isfinite(elapsed) && elapsed >= 0.0))
    throw std::invalid_argument("shift: elapsed is " + std::to_string(elapsed) +
                                "; it must be a non-negative number of seconds");
  const Eigen::Index horizon = trajectory.rows() - 1;
  if (horizon < 1 || trajectory.cols() != problem.nz() || spacing.size() < horizon)
    throw std::invalid_argument("shift: a trajectory of shape [" +
                                std::to_string(trajectory.rows()) + ", " +
                                std::to_string(trajectory.cols()) + "] and " +
                                std::to_string(spacing.size()) + " spacings do not fit");
  if (!(spacing.head(horizon).array() > 0.0).all())
    throw std::invalid_argument("shift: every knot spacing must be positive");

  // The interval of the old plan that holds `time`, and how far into it; the last one extrapolates.
  auto locate = [&](double time) {
    Eigen::Index k = 0;
    while (k < horizon - 1 && time >= spacing[k] * (1.0 - 1e-9)) time -= spacing[k++];
    return std::pair<Eigen::Index, double>(k, time / spacing[k]);
  };
  double time = elapsed;
  for (Eigen::Index k = 0; k <= horizon; ++k) {
    const auto [left, fraction] = locate(time);
    const double interval = k < horizon ? spacing[k] : spacing[horizon - 1];
    const auto [held, unused] = locate(time + 0.5 * interval);
    for (const BlockInfo& b : problem.blocks()) {
      auto from = trajectory.row(left).segment(b.offset, b.size);
      auto to = trajectory.row(left + 1).segment(b.offset, b.size);
      auto out = shifted.row(k).segment(b.offset, b.size);
      if (!b.is_state)
        out = trajectory.row(held).segment(b.offset, b.size);
      else if (b.is_quaternion)
        out = quaternion_interpolate(from.transpose(), to.transpose(), fraction).transpose();
      else
        out = from + fraction * (to - from);
    }
    time += interval;
  }
}

void align_quaternions(const LoweredProblem& problem, const double* reference, double* z) {
  for (const BlockInfo& b : problem.blocks()) {
    if (!b.is_quaternion) continue;
    Eigen::Map<Vector4> q(z + b.offset);
    q = quaternion_aligned(q, quaternion_at(reference + b.offset));
  }
}

}  // namespace palanquin
