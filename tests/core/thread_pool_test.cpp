// Loops over knots on one and more threads.
#include "palanquin/core/thread_pool.hpp"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(ThreadPool, VisitsEveryIndexOnceOnItsOwnThread) {
  for (int threads : {1, 2, 3})
    for (int count : {0, 1, 2, 7, 100}) {
      ThreadPool pool(threads);
      ASSERT_EQ(pool.size(), threads);
      std::vector<int> visits(static_cast<std::size_t>(count), 0);
      std::vector<int> visitor(static_cast<std::size_t>(count), -1);
      pool.parallel_for(count, [&](int thread, int i) {
        ++visits[static_cast<std::size_t>(i)];
        visitor[static_cast<std::size_t>(i)] = thread;
      });
      for (int i = 0; i < count; ++i) {
        EXPECT_EQ(visits[static_cast<std::size_t>(i)], 1);
        EXPECT_EQ(visitor[static_cast<std::size_t>(i)], i % threads);
      }
    }
}

TEST(ThreadPool, GivesTheSameBitsForAnyNumberOfThreads) {
  const std::vector<double> one = work(1, 37, 500);
  EXPECT_EQ(work(2, 37, 500), one);
  EXPECT_EQ(work(4, 37, 500), one);
}

TEST(ThreadPool, RefusesLessThanOneThread) { EXPECT_THROW(ThreadPool(0), std::invalid_argument); }

}  // namespace
}  // namespace palanquin
