#pragma once

#include <chrono>

namespace palanquin {

/// Wall-clock time since construction or the last lap.
class Stopwatch {
 public:
  /// Milliseconds since the last call, which starts the next lap.
  double lap_ms() {
    const auto now = Clock::now();
    const std::chrono::duration<double, std::milli> elapsed = now - start_;
    start_ = now;
    return elapsed.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace palanquin
