#pragma once

#include <atomic>
#include <stdexcept>
#include <string>

namespace palanquin {

/// Guards an object that one thread may change at a time: a call that would meet another one is
/// refused in words. Never waits, so that nothing hangs, in a forked process either.
class SingleUser {
 public:
  /// The right to use the object until destroyed.
  class Use {
   public:
    Use(std::atomic<int>& users, int change) : users_(users), change_(change) {}
    ~Use() { users_.fetch_sub(change_, std::memory_order_release); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    std::atomic<int>& users_;
    int change_;
  };

  /// Messages call the object `what`; `hint` says what other threads may do.
  explicit SingleUser(const char* what, const char* hint = "") : what_(what), hint_(hint) {}

  /// For a call that changes the object. Throws std::logic_error that names `call` while there is
  /// any other.
  [[nodiscard]] Use change(const char* call) const {
    int nobody = 0;
    if (!users_.compare_exchange_strong(nobody, kChanging, std::memory_order_acquire)) refuse(call);
    return {users_, kChanging};
  }
  /// For a call that reads it. Throws std::logic_error that names `call` while it is changed.
  [[nodiscard]] Use read(const char* call) const {
    int users = users_.load(std::memory_order_relaxed);
    do {
      if (users < 0) refuse(call);
    } while (!users_.compare_exchange_weak(users, users + 1, std::memory_order_acquire));
    return {users_, 1};
  }

 private:
  static constexpr int kChanging = -1;

  [[noreturn]] void refuse(const char* call) const {
    const std::string what = what_;
    throw std::logic_error(std::string(call) + ": another thread uses this " + what + "; a " +
                           what + " serves one thread at a time" + hint_);
  }

  const char* what_;
  const char* hint_;
  mutable std::atomic<int> users_{0};  // how many read, or kChanging
};

}  // namespace palanquin
