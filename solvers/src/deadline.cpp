#include "palanquin/solvers/deadline.hpp"

#include <utility>

namespace palanquin {

namespace {
constexpr std::chrono::milliseconds kQuestions{100};  // between two
}

void Deadline::clear() { *this = {}; }

void Deadline::set(double seconds, GoesOn goes_on) {
  clear();
  const Clock::time_point now = Clock::now();
  if (seconds < kNoLimit)
    end_ =
        now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  next_question_ = now + kQuestions;
  goes_on_ = std::move(goes_on);
}

bool Deadline::has_passed() {
  if (was_noticed_ || (!is_limited() && !goes_on_)) return was_noticed_;
  const Clock::time_point now = Clock::now();
  if (goes_on_ && now >= next_question_) {
    was_stopped_ = !goes_on_();
    next_question_ = now + kQuestions;
  }
  return was_noticed_ = was_stopped_ || now >= end_;
}

}  // namespace palanquin
