#pragma once

#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// "name[index]", for a rule about one entry of a list.
inline std::string entry(std::string name, std::size_t index) {
  name += '[';
  name += std::to_string(index);
  name += ']';
  return name;
}

/// Collects the first broken rule among a group of settings:
///   return SettingRules("osqp.").positive("rho", rho).at_least("max_iterations", n, 1).sentence();
class SettingRules {
 public:
  explicit SettingRules(std::string prefix = "") : prefix_(std::move(prefix)) {}

  SettingRules& positive(const std::string& field, double value) {
    return check(std::isfinite(value) && value > 0.0, field, value, "finite and positive");
  }
  SettingRules& not_negative(const std::string& field, double value) {
    return check(std::isfinite(value) && value >= 0.0, field, value, "finite and not negative");
  }
  SettingRules& finite(const std::string& field, double value) {
    return check(std::isfinite(value), field, value, "finite");
  }
  SettingRules& finite(const std::string& field, const Vector3& value) {
    return check(value.allFinite(), field, value.transpose(), "finite");
  }
  SettingRules& at_least(const std::string& field, int value, int lowest) {
    return check(value >= lowest, field, value, "at least " + std::to_string(lowest));
  }
  /// An index of `count` things.
  SettingRules& one_of(const std::string& field, int value, int count, int first = 0) {
    return check(value >= first && value < count, field, value,
                 "from " + std::to_string(first) + " to " + std::to_string(count - 1));
  }
  template <class Value>
  SettingRules& check(bool holds, const std::string& field, const Value& value,
                      const std::string& rule) {
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
  /// The same for a group with its own name: `prefix` comes before its sentence.
  SettingRules& nested(const std::string& prefix, const std::string& sentence) {
    return sentence.empty() ? *this : nested(prefix + sentence);
  }

  /// An empty string when every rule holds.
  std::string sentence() const { return sentence_; }

 private:
  std::string prefix_;
  std::string sentence_;
};

}  // namespace palanquin
