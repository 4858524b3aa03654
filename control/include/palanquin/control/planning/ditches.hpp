#pragma once

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// Strips of ground (11) that no foot may step into: along a x + b y + c = 0 and d wide, each a row
/// (a, b, c, d) of `lines` [n, 4], m. What leaves a ditch comes to lie 1 cm beyond its edge.
class Ditches {
 public:
  explicit Ditches(MatrixView lines);
  Ditches() : Ditches(RowMatrix(0, 4)) {}

  bool is_empty() const { return lines_.rows() == 0; }
  const RowMatrix& lines() const { return lines_; }
  Eigen::Index size() const { return lines_.rows(); }
  /// How deep a point lies in a ditch, m; negative outside.
  double depth(Eigen::Index ditch, const Vector2& p) const;
  /// Of the deepest ditch, at least 0.
  double deepest(const Vector2& p) const;
  /// The point moved out of its deepest ditch, over the nearer edge or the other one, and on out of
  /// further ones the same way.
  Vector2 leave(const Vector2& p, bool nearer) const;
  /// The point itself outside of all ditches, or the nearer way out.
  Vector2 nearest_clear(const Vector2& p) const;

 private:
  double offset(Eigen::Index ditch, const Vector2& p) const;

  RowMatrix lines_;
  Eigen::VectorXd lengths_;  ///< of (a, b)
};

}  // namespace palanquin::planning
