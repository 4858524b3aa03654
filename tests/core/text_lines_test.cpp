#include "palanquin/core/text_lines.hpp"

#include <gtest/gtest.h>

#include <string>

namespace palanquin {
namespace {

TEST(TextLinesTest, ALineIsQuotedByItsFirstWholeCharacters) {
  EXPECT_EQ(excerpt(""), "''");
  EXPECT_EQ(excerpt("name car"), "'name car'");
  EXPECT_EQ(excerpt(std::string(100, 'a')), "'" + std::string(80, 'a') + "'");
  for (const std::string character : {"é", "→", "🐕"})
    for (std::size_t before = 75; before <= 82; ++before) {
      const std::string start(before, 'a');
      const bool fits = before + character.size() <= 80;
      const std::string expected = fits ? start + character : start.substr(0, 80);
      EXPECT_EQ(excerpt(start + character + std::string(20, '\0')).substr(0, expected.size() + 1),
                "'" + expected);
      if (fits) continue;
      EXPECT_EQ(excerpt(start + character), "'" + expected + "'");
    }
}

}  // namespace
}  // namespace palanquin
