#pragma once

#include <string>

namespace palanquin {

enum class LegPhase {
  Stance,    ///< on the ground: it carries
  Swing,     ///< on its way
  Reaching,  ///< due on the ground, which it doesn't feel: it goes on downwards
};

struct ContactSettings {
  double touch_force = 8;    ///< normal force that counts as contact, N, over 0
  double release_force = 2;  ///< below which a standing foot has lost the ground, N
  double lost_time = 0.015;  ///< for so long, s
  double earliest = 0.5;     ///< share of the swing after which a contact is a touchdown
  double early_force = 15;   ///< that a foot is to bear which landed before it was due, N

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;
};

/// Decides by the schedule and the foot's force sensor whether a leg stands: a contact late in the
/// swing ends it early, and a leg that is due but feels nothing reaches until it does.
class ContactMonitor {
 public:
  /// Throws std::invalid_argument with the settings' `explain_invalid()`.
  explicit ContactMonitor(const ContactSettings& settings = {});

  /// One period of `dt` s. `is_due`: the schedule has the leg stand; `progress`: the share of its
  /// swing that is over, if it has not; `force`: normal force of the foot, N.
  void update(bool is_due, double progress, double force, double dt);

  LegPhase phase() const { return phase_; }
  bool has_changed() const { return has_changed_; }  ///< in the last update
  /// Stands although it was not due, or is due but does not stand.
  bool is_early() const { return phase_ == LegPhase::Stance && !was_due_; }
  bool is_late() const { return phase_ != LegPhase::Stance && was_due_; }

 private:
  LegPhase next(bool is_due, double progress, double force, double dt);

  ContactSettings settings_;
  LegPhase phase_ = LegPhase::Stance;
  bool was_due_ = true, has_changed_ = false;
  double unloaded_ = 0;  ///< time without force in stance, s
};

}  // namespace palanquin
