#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace palanquin {

/// A fixed team of threads for loops over knots. The caller is one of them, so a pool of one thread
/// is a plain loop. Whoever is free takes the next index: the caller never waits for a thread that
/// sleeps, and what a loop gives must not depend on who does what. Threads that have nothing to do
/// look out for the next loop for a while before they sleep, if there is a processor for each.
///
/// A process that was forked off has none of its parent's threads: a pool that it inherits starts
/// its own at the next loop.
class ThreadPool {
 public:
  /// Throws std::invalid_argument when `threads` < 1, std::system_error when the system refuses a
  /// thread.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return size_; }

  /// Calls body(thread, i) once for every i in [0, count), 0 <= thread < size() being no other's at
  /// that time, and returns when all are done. `body` must not throw.
  template <typename Body>
  void parallel_for(int count, const Body& body) {
    run(count, std::cref(body));  // a reference fits into std::function without allocation
  }

 private:
  void start();
  void stop();
  void run(int count, const std::function<void(int, int)>& body);
  void take_turns(int thread);
  void work(int thread);

  int size_;
  bool may_spin_;
  unsigned process_;  // which it was started in, see process_generation()
  std::vector<std::thread> workers_;
  const std::function<void(int, int)>* body_ = nullptr;
  /// Loop, count and next index in one number: an index is taken of the loop at hand or not at all.
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<int> generation_{0};
  std::atomic<int> pending_{0};  ///< indices that are not done
  std::atomic<bool> stopping_{false};
};

}  // namespace palanquin
