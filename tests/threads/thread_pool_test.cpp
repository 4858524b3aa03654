// Loops over knots on one and more threads.
#include "palanquin/core/thread_pool.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

namespace palanquin {
namespace {

std::vector<double> work(int threads, int count, int rounds) {
  ThreadPool pool(threads);
  std::vector<double> values(static_cast<std::size_t>(count), 1.0);
  for (int round = 0; round < rounds; ++round)
    pool.parallel_for(count, [&](int, int i) {
      double& v = values[static_cast<std::size_t>(i)];
      v = std::sin(v + i) + round * 1e-3;
    });
  return values;
}

TEST(ThreadPool, VisitsEveryIndexOnce) {
  for (int threads : {1, 2, 3})
    for (int count : {0, 1, 2, 7, 100}) {
      ThreadPool pool(threads);
      ASSERT_EQ(pool.size(), threads);
      std::vector<int> visits(static_cast<std::size_t>(count), 0);
      std::vector<int> busy(static_cast<std::size_t>(threads), 0);
      for (int round = 0; round < 50; ++round)
        pool.parallel_for(count, [&](int thread, int i) {
          EXPECT_EQ(busy[static_cast<std::size_t>(thread)]++, 0)
              << "a number is one thread's alone";
          ++visits[static_cast<std::size_t>(i)];
          --busy[static_cast<std::size_t>(thread)];
        });
      for (int v : visits) EXPECT_EQ(v, 50);
    }
}

TEST(ThreadPool, GivesTheSameBitsForAnyNumberOfThreads) {
  const std::vector<double> one = work(1, 37, 500);
  EXPECT_EQ(work(2, 37, 500), one);
  EXPECT_EQ(work(4, 37, 500), one);
}

TEST(ThreadPool, RefusesLessThanOneThread) { EXPECT_THROW(ThreadPool(0), std::invalid_argument); }

// ThreadSanitizer does not take threads that a forked process starts.
#if !defined(__SANITIZE_THREAD__)
/// Whether `work` is true in a forked process; one that hangs is ended.
template <typename Work>
bool in_a_fork(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    _exit(work() ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status == 0;
}

TEST(ThreadPool, WorksInAForkedProcess) {
  for (int threads : {1, 2, 4}) {
    ThreadPool pool(threads);
    const auto sum = [&] {
      std::vector<int> values(100, 0);
      pool.parallel_for(100, [&](int, int i) { values[static_cast<std::size_t>(i)] = i; });
      int total = 0;
      for (int value : values) total += value;
      return total;
    };
    EXPECT_EQ(sum(), 4950);
    EXPECT_TRUE(in_a_fork([&] {
      return sum() == 4950 && sum() == 4950 && in_a_fork([&] { return sum() == 4950; });
    }));
    EXPECT_EQ(sum(), 4950);
  }
}

TEST(ThreadPool, MayEndInAForkedProcess) {
  auto pool = std::make_unique<ThreadPool>(3);
  EXPECT_TRUE(in_a_fork([&] {
    pool.reset();
    return true;
  }));
}
#endif

}  // namespace
}  // namespace palanquin
