#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace palanquin {

/// A fixed team of threads for loops over knots. The caller is one of them, so a pool of one thread
/// is a plain loop. Work is divided statically, so results do not depend on timing.
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

  /// Calls body(thread, i) for i in [0, count), thread t taking i with i % size() == t, and returns
  /// when all are done. `body` must not throw.
  template <typename Body>
  void parallel_for(int count, const Body& body) {
    run(count, std::cref(body));  // a reference fits into std::function without allocation
  }

 private:
  void start();
  void stop();
  void run(int count, const std::function<void(int, int)>& body);
  void work(int thread);

  int size_;
  unsigned process_;  // which it was started in, see process_generation()
  std::vector<std::thread> workers_;
  const std::function<void(int, int)>* body_ = nullptr;
  int count_ = 0;
  std::atomic<int> generation_{0};
  std::atomic<int> pending_{0};
  std::atomic<bool> stopping_{false};
};

}  // namespace palanquin
