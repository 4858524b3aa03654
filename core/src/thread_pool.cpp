#include "palanquin/core/thread_pool.hpp"

#include <stdexcept>
#include <string>

namespace palanquin {

ThreadPool::ThreadPool(int threads) {
  if (threads < 1)
    throw std::invalid_argument("threads is " + std::to_string(threads) + "; at least 1 is needed");
  for (int t = 1; t < threads; ++t) workers_.emplace_back([this, t] { work(t); });
}

ThreadPool::~ThreadPool() {
  stopping_ = true;
  ++generation_;
  generation_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run(int count, const std::function<void(int, int)>& body) {
  if (!workers_.empty()) {
    body_ = &body;
    count_ = count;
    pending_ = static_cast<int>(workers_.size());
    ++generation_;
    generation_.notify_all();
  }
  for (int i = 0; i < count; i += size()) body(0, i);
  for (int left = pending_; left > 0; left = pending_) pending_.wait(left);
}

void ThreadPool::work(int thread) {
  int seen = 0;
  while (true) {
    generation_.wait(seen);
    seen = generation_;
    if (stopping_) return;
    for (int i = thread; i < count_; i += size()) (*body_)(thread, i);
    if (--pending_ == 0) pending_.notify_one();
  }
}

}  // namespace palanquin
