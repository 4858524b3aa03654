#include "palanquin/core/thread_pool.hpp"

#include <pthread.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace palanquin {

namespace {

std::atomic<unsigned> forks{0};

/// Another number in every process that was forked off.
unsigned process_generation() {
  static const int registered =
      pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
  return registered == 0 ? forks.load(std::memory_order_relaxed) : 0;
}

/// Handles of threads that this process does not have can be neither joined nor destroyed.
void abandon(std::vector<std::thread> workers) {
  static auto& abandoned = *new std::vector<std::vector<std::thread>>;
  abandoned.push_back(std::move(workers));
}

}  // namespace

ThreadPool::ThreadPool(int threads) : size_(threads), process_(process_generation()) {
  if (threads < 1)
    throw std::invalid_argument("threads is " + std::to_string(threads) + "; at least 1 is needed");
  start();
}

ThreadPool::~ThreadPool() {
  if (process_ == process_generation())
    stop();
  else
    abandon(std::move(workers_));
}

void ThreadPool::start() {
  stopping_ = false;
  generation_ = 0;
  pending_ = 0;
  try {
    for (int t = 1; t < size_; ++t) workers_.emplace_back([this, t] { work(t); });
  } catch (...) {
    stop();
    throw;
  }
}

void ThreadPool::stop() {
  stopping_ = true;
  ++generation_;
  generation_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
}

void ThreadPool::run(int count, const std::function<void(int, int)>& body) {
  if (size_ > 1) {
    if (process_ != process_generation()) {
      abandon(std::exchange(workers_, {}));
      start();
      process_ = process_generation();
    }
    body_ = &body;
    count_ = count;
    pending_ = static_cast<int>(workers_.size());
    ++generation_;
    generation_.notify_all();
  }
  for (int i = 0; i < count; i += size_) body(0, i);
  for (int left = pending_; left > 0; left = pending_) pending_.wait(left);
}

void ThreadPool::work(int thread) {
  int seen = 0;
  while (true) {
    generation_.wait(seen);
    seen = generation_;
    if (stopping_) return;
    for (int i = thread; i < count_; i += size_) (*body_)(thread, i);
    if (--pending_ == 0) pending_.notify_one();
  }
}

}  // namespace palanquin
