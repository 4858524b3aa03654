#include "palanquin/core/thread_pool.hpp"

#include <pthread.h>

#include <chrono>
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

// A ticket is (loop kIndices + count) kIndices + next index.
constexpr std::uint64_t kIndices = 1024 * 1024;

int next_of(std::uint64_t ticket) { return static_cast<int>(ticket % kIndices); }
int count_of(std::uint64_t ticket) { return static_cast<int>(ticket / kIndices % kIndices); }
std::uint64_t following(std::uint64_t ticket, int count) {
  const std::uint64_t loop = ticket / kIndices / kIndices + 1;
  return (loop * kIndices + static_cast<std::uint64_t>(count)) * kIndices;
}

/// How long a thread looks out before it sleeps: longer than a step's phases without a loop.
constexpr std::chrono::microseconds kLookOut{200};

void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits until `value` is not `old`, and returns what it is.
int await_change(const std::atomic<int>& value, int old, bool may_spin) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + kLookOut;
  while (may_spin && value == old && Clock::now() < end)
    for (int i = 0; i < 32 && value.load(std::memory_order_relaxed) == old; ++i) relax();
  value.wait(old);
  return value;
}

}  // namespace

ThreadPool::ThreadPool(int threads)
    : size_(threads),
      may_spin_(threads <= static_cast<int>(std::thread::hardware_concurrency())),
      process_(process_generation()) {
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
  if (size_ == 1 || count < 2 || count >= static_cast<int>(kIndices)) {
    for (int i = 0; i < count; ++i) body(0, i);
    return;
  }
  if (process_ != process_generation()) {
    abandon(std::exchange(workers_, {}));
    start();
    process_ = process_generation();
  }
  body_ = &body;
  pending_ = count;
  ticket_ = following(ticket_, count);
  ++generation_;
  generation_.notify_all();
  take_turns(0);
  for (int left = pending_; left > 0;) left = await_change(pending_, left, may_spin_);
}

/// Takes indices of the loop at hand until none is left.
void ThreadPool::take_turns(int thread) {
  std::uint64_t ticket = ticket_;
  while (next_of(ticket) < count_of(ticket)) {
    if (!ticket_.compare_exchange_weak(ticket, ticket + 1)) continue;
    (*body_)(thread, next_of(ticket));
    if (--pending_ == 0) pending_.notify_one();
    ticket = ticket_;
  }
}

void ThreadPool::work(int thread) {
  for (int seen = 0; !stopping_;) {
    seen = await_change(generation_, seen, may_spin_);
    if (!stopping_) take_turns(thread);
  }
}

}  // namespace palanquin
