#pragma once

#include <chrono>
#include <functional>

namespace palanquin {

/// Asked by a long solve, from the thread that solves; false stops it.
using GoesOn = std::function<bool()>;

/// When a solve has to end: after a time, or when its caller says so.
class Deadline {
 public:
  static constexpr double kNoLimit = 1e8;  ///< s; later than the clock can say

  /// No end.
  void clear();
  /// In `seconds`, if they are less than kNoLimit. `goes_on`, which may be empty, is asked at most
  /// every 0.1 s: a solve at control rate never asks.
  void set(double seconds, GoesOn goes_on);
  bool is_limited() const { return end_ != Clock::time_point::max(); }  ///< in time
  bool has_passed();
  /// What has passed() found.
  bool was_noticed() const { return was_noticed_; }
  bool was_stopped() const { return was_stopped_; }  ///< by the caller

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point end_ = Clock::time_point::max(), next_question_;
  GoesOn goes_on_;
  bool was_noticed_ = false, was_stopped_ = false;
};

}  // namespace palanquin
