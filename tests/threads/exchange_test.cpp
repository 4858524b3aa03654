// Values from thread to thread without waiting.
#include "palanquin/control/planning/exchange.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace palanquin::planning {
namespace {

TEST(Exchange, GivesTheLatestValueOnce) {
  Exchange<int> exchange(0);
  EXPECT_FALSE(exchange.has_news());
  EXPECT_EQ(exchange.latest(), 0);
  for (int value : {1, 2, 3}) {
    exchange.draft() = value;
    exchange.publish();
  }
  EXPECT_TRUE(exchange.has_news());
  EXPECT_EQ(exchange.latest(), 3);
  EXPECT_FALSE(exchange.has_news());
  EXPECT_EQ(exchange.latest(), 3);
}

TEST(Exchange, ValuesArriveWholeAndInOrder) {
  constexpr int kLast = 20000;
  Exchange<std::vector<int>> exchange(std::vector<int>(64, 0));
  std::thread writer([&] {
    for (int value = 1; value <= kLast; ++value) {
      exchange.draft().assign(64, value);
      exchange.publish();
    }
  });
  int seen = 0;
  while (seen < kLast) {
    const std::vector<int>& value = exchange.latest();
    ASSERT_EQ(value.front(), value.back());
    ASSERT_GE(value.front(), seen);
    seen = value.front();
  }
  writer.join();
}

}  // namespace
}  // namespace palanquin::planning
