#pragma once

#include "palanquin/control/planning/references.hpp"

namespace palanquin::planning {

/// What is known before a solve.
struct Instant {
  double time = 0.0;  ///< of the first knot, s
  References references;
  Flags contacts;  ///< at the knots [N + 1, 4 R]
  Flags before;    ///< just before the first knot [1, 4 R]
  RowMatrix feet;  ///< measured, world, m, [4 R, 3]

  /// Whether foot `i` stands at knot `k` and did not at the one before.
  bool is_landing(Eigen::Index k, int i) const {
    return contacts(k, i) && !(k == 0 ? before(0, i) : contacts(k - 1, i));
  }
  /// Makes feet [N + 1, 12 R] obey (7): as they are in swing and on landing, then kept; those that
  /// stand from the beginning on stay where they were measured.
  void carry(RowMatrix& positions) const;
};

/// Ground reaction force of a foot that stands at knot `k`, N, so that each robot carries itself
/// and an equal share of the payload, evenly on its standing feet.
Vector3 carrying_force(const Team& team, const Flags& contacts, Eigen::Index k, int foot);

}  // namespace palanquin::planning
