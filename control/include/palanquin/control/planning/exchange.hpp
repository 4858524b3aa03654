#pragma once

#include <array>
#include <atomic>

namespace palanquin::planning {

/// Hands the latest value on from one writing to one reading thread. Neither ever waits, nothing is
/// allocated: three slots, of which the writer fills one, the reader reads another, and the third
/// changes hands.
template <typename T>
class Exchange {
 public:
  /// Every slot starts as a copy of `initial`, which so has the size that values will have.
  explicit Exchange(const T& initial) : slots_{initial, initial, initial} {}

  /// The writer's slot, to be filled. What it holds is some older value.
  T& draft() { return slots_[back_]; }
  /// Hands the draft over.
  void publish() { back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kSlot; }

  /// Whether something was published since the reader took the latest value.
  bool has_news() const { return (middle_.load(std::memory_order_acquire) & kNew) != 0; }
  /// The reader's slot, with the latest value that was published; valid until the next call.
  const T& latest() {
    if (has_news()) front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kSlot;
    return slots_[front_];
  }

 private:
  static constexpr unsigned kSlot = 3, kNew = 4;

  std::array<T, 3> slots_;
  unsigned back_ = 0;
  std::atomic<unsigned> middle_{1};
  unsigned front_ = 2;
};

}  // namespace palanquin::planning
