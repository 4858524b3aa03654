#pragma once

#include <deque>
#include <optional>
#include <random>
#include <vector>

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// A planner's optimal solution, as it sends it to its neighbours (Kim et al., Remark 5).
struct Message {
  int step = 0;                 ///< sample at which it was made
  Matrix3 operating;            ///< R_op that xi is about
  RowMatrix states;             ///< (r, v, xi, w), [N + 1, 12]
  RowMatrix inputs;             ///< forces [N, 12]
  std::vector<RowMatrix> bars;  ///< multipliers [N, rows] by the bar's index; empty: not its own
  RowMatrix dual;               ///< multipliers beta of its dynamics, [N, 12]
  RowMatrix feet;               ///< where its feet stand, [4, 3]
  bool is_held = false;         ///< no plan but a state held for want of one

  /// The multipliers of a bar as seen `steps` samples later, [N, rows].
  RowMatrix aged_bar(int bar, int steps) const;
  /// The same plan as seen `steps` samples later, xi about the rotation planned for then. States
  /// and multipliers are held at the end, forces are 0 beyond it.
  Message aged(int steps) const;
};

/// A link between two planners.
struct LinkSettings {
  int delay = 1;      ///< samples from sending to hearing, at least 1 (Assumption 2 has 1)
  double loss = 0.0;  ///< probability that a message is lost; the newest one heard is kept
  double bias = 0.0;  ///< added to the multipliers that a receiver agrees on, N/m (Fig. 23)
  int bias_from = 0;  ///< sample from which on it is added
  unsigned seed = 0;  ///< of the losses
};

/// One direction of a link: messages in, the newest that has arrived out. The first one, a
/// greeting, always arrives.
class Link {
 public:
  explicit Link(const LinkSettings& settings) : settings_(settings), random_(settings.seed) {}

  /// Puts a message on its way, or loses it.
  void send(Message message);
  /// The newest message that has arrived by `step`, as seen now. Throws std::logic_error before the
  /// greeting.
  Message receive(int step);
  /// What is added to the multipliers at `step`.
  double bias(int step) const { return step >= settings_.bias_from ? settings_.bias : 0.0; }
  const LinkSettings& settings() const { return settings_; }

 private:
  LinkSettings settings_;
  std::mt19937_64 random_;
  std::deque<Message> sent_;
  std::optional<Message> heard_;
};

}  // namespace palanquin::planning
