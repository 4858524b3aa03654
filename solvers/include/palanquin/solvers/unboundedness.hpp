#pragma once

namespace palanquin {

/// Tells an objective without a lower bound from one that is far down: the trajectory is large, and
/// the cost falls by as much in every step as in the one before, where steps towards a minimum
/// gain less and less (docs/algorithms.md, section 6).
class UnboundednessTest {
 public:
  void reset(double start_size);
  /// After an accepted step that took the cost from `before` to `after` and the largest entry of
  /// the trajectory to `size`. True when the cost is held to be unbounded.
  bool update(double before, double after, double size, double limit);

 private:
  double start_size_ = 1.0;
  double last_decrease_ = 0.0;
  int count_ = 0;
};

}  // namespace palanquin
