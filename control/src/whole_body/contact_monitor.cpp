#include "palanquin/control/whole_body/contact_monitor.hpp"

#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string ContactSettings::explain_invalid() const {
  return SettingRules()
      .positive("touch_force", touch_force)
      .not_negative("release_force", release_force)
      .check(release_force <= touch_force, "release_force", release_force, "at most touch_force")
      .not_negative("lost_time", lost_time)
      .not_negative("earliest", earliest)
      .check(earliest <= 1, "earliest", earliest, "at most 1, the whole swing")
      .not_negative("early_force", early_force)
      .sentence();
}

ContactMonitor::ContactMonitor(const ContactSettings& settings) : settings_(settings) {
  if (auto text = settings.explain_invalid(); !text.empty())
    throw std::invalid_argument("contact monitor: " + text);
}

void ContactMonitor::update(bool is_due, double progress, double force, double dt) {
  const LegPhase before = phase_;
  phase_ = next(is_due, progress, force, dt);
  has_changed_ = phase_ != before;
  was_due_ = is_due;
}

LegPhase ContactMonitor::next(bool is_due, double progress, double force, double dt) {
  const bool touches = force >= settings_.touch_force;
  unloaded_ = phase_ == LegPhase::Stance && force < settings_.release_force ? unloaded_ + dt : 0;
  if (!is_due) {
    if (was_due_) return LegPhase::Swing;  // scheduled lift-off
    if (phase_ == LegPhase::Swing && touches && progress >= settings_.earliest)
      return LegPhase::Stance;  // early touchdown
    return phase_ == LegPhase::Reaching ? LegPhase::Swing : phase_;
  }
  if (phase_ == LegPhase::Stance)
    return unloaded_ > settings_.lost_time ? LegPhase::Reaching : LegPhase::Stance;
  return touches ? LegPhase::Stance : LegPhase::Reaching;
}

}  // namespace palanquin
