#pragma once

#include <cmath>
#include <sstream>
#include <string>

namespace palanquin {

/// Collects the first broken rule among a group of settings:
///   return SettingRules("osqp.").positive("rho", rho).at_least("max_iterations", n, 1).sentence();
class SettingRules {
 public:
  explicit SettingRules(std::string prefix = "") : prefix_(std::move(prefix)) {}

  SettingRules& positive(const char* field, double value) {
    return check(std::isfinite(value) && value > 0.0, field, value, "finite and positive");
  }
  SettingRules& not_negative(const char* field, double value) {
    return check(std::isfinite(value) && value >= 0.0, field, value, "finite and not negative");
  }
  SettingRules& at_least(const char* field, int value, int lowest) {
    return check(value >= lowest, field, value, "at least " + std::to_string(lowest));
  }
  SettingRules& check(bool holds, const char* field, double value, const std::string& rule) {
    if (!holds && sentence_.empty()) {
      std::ostringstream text;
      text << prefix_ << field << " is " << value << ", but must be " << rule;
      sentence_ = text.str();
    }
    return *this;
  }
  SettingRules& nested(const std::string& sentence) {
    if (sentence_.empty()) sentence_ = sentence;
    return *this;
  }

  /// An empty string when every rule holds.
  std::string sentence() const { return sentence_; }

 private:
  std::string prefix_;
  std::string sentence_;
};

}  // namespace palanquin
