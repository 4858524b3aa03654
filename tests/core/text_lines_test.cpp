#include "palanquin/core/text_lines.hpp"

#include <gtest/gtest.h>

#include <string>

namespace palanquin {
namespace {

TEST(TextLinesTest, ALineIsQuotedByItsFirstWholeCharacters) {
  EXPECT_EQ(quoted(""), "''");
  EXPECT_EQ(quoted("name car"), "'name car'");
  EXPECT_EQ(quoted(std::string(100, 'a')), "'" + std::string(80, 'a') + "'");
  for (const std::string character : {"é", "→", "🐕"})
    for (std::size_t before = 75; before <= 82; ++before) {
      const std::string start(before, 'a');
      const bool fits = before + character.size() <= 80;
      const std::string expected = fits ? start + character : start.substr(0, 80);
      EXPECT_EQ(quoted(start + character + std::string(20, '\0')).substr(0, expected.size() + 1),
                "'" + expected);
      if (!fits) EXPECT_EQ(quoted(start + character), "'" + expected + "'");
    }
}

}  // namespace
}  // namespace palanquin
