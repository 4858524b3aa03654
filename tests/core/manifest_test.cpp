#include "palanquin/core/manifest.hpp"

#include <gtest/gtest.h>

#include <locale>
#include <random>
#include <stdexcept>

namespace palanquin {
namespace {

const std::string kWhole =
    "palanquin 2\n"
    "content 0123abcd\n"
    "name car\n"
    "block pose real 3 state 0\n"
    "block attitude quaternion 4 state 0\n"
    "block foot real 3 variable 2\n"
    "block wheels real 2 variable 0\n"
    "parameter dt 1\n"
    "parameter goal 3\n"
    "parameter map 2 2\n"
    "rows running inequality lane left - 1 0 100.5\n"
    "rows running inequality reach - LF 2 0 1.0\n"
    "rows terminal inequality lane - - 1 0 1.0\n"
    "rows running link contact - - 3 1 1.0\n"
    "horizon 30\n"
    "default dt 0.05\n"
    "default goal 1.5 -2e-05 0.0\n"
    "default map 1.0 2.0 3.0 4.0\n"
    "policy lane hard 0.0 0.0\n"
    "policy reach c2_penalty 4200.5 0.001\n";

std::string without(const std::string& line) {
  std::string text = kWhole;
  const std::size_t at = text.find(line);
  EXPECT_NE(at, std::string::npos) << line;
  return text.erase(at, text.find('\n', at) - at + 1);
}

std::string with(const std::string& line, const std::string& other) {
  std::string text = kWhole;
  const std::size_t at = text.find(line);
  EXPECT_NE(at, std::string::npos) << line;
  return text.replace(at, line.size(), other);
}

std::string complaint(const std::string& text) {
  try {
    parse_manifest(text, "FILE");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

void expect_whole(const Manifest& m) {
  EXPECT_EQ(m.name, "car");
  EXPECT_EQ(m.content, "0123abcd");
  EXPECT_EQ(m.horizon, 30);
  ASSERT_EQ(m.blocks.size(), 4u);
  EXPECT_EQ(m.blocks[1].tangent_size, 3);
  EXPECT_EQ(m.blocks[2].offset, 7);
  EXPECT_EQ(m.blocks[2].tangent_offset, 6);
  EXPECT_EQ(m.blocks[3].slope_offset, 6);
  ASSERT_EQ(m.parameters.size(), 3u);
  EXPECT_EQ(m.parameters[1].defaults, (std::vector<double>{1.5, -2e-5, 0.0}));
  EXPECT_EQ(m.parameters[2].offset, 4);
  EXPECT_EQ(m.parameters[2].shape, (std::vector<int>{2, 2}));
  const auto& rows = m.rows[0][static_cast<std::size_t>(RowKind::Inequality)];
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].scale, 100.5);
  EXPECT_EQ(rows[0].robot, "left");
  EXPECT_EQ(rows[1].offset, 1);
  EXPECT_EQ(m.policies.at("lane").kind, PolicyKind::Hard);
  EXPECT_EQ(m.policies.at("reach"), (Policy{PolicyKind::C2Penalty, 4200.5, 0.001}));
}

TEST(Manifest, SaysWhatItStates) { expect_whole(parse_manifest(kWhole, "FILE")); }

/// Numbers as in Germany: 1.234,5.
struct German : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Manifest, IsReadTheSameInEveryLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new German));
  const Manifest manifest = parse_manifest(kWhole, "FILE");
  std::locale::global(before);
  expect_whole(manifest);
}

TEST(Manifest, StructureLeavesOutWhatChangesWithoutLowering) {
  const Manifest one = parse_manifest(kWhole, "FILE");
  for (const auto& [line, other] : std::vector<std::pair<std::string, std::string>>{
           {"horizon 30", "horizon 5"},
           {"default dt 0.05", "default dt 1.0"},
           {"policy lane hard 0.0 0.0", "policy lane squared_hinge 7.0 0.0"}})
    EXPECT_EQ(parse_manifest(with(line, other), "FILE").structure, one.structure) << other;
  EXPECT_NE(parse_manifest(with("real 2", "real 3"), "FILE").structure, one.structure);
  EXPECT_NE(parse_manifest(with("0123", "4567"), "FILE").structure, one.structure);
}

TEST(Manifest, RefusesDamageInWords) {
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"", "'FILE' holds no whole manifest: it states no name"},
           {"name car\n", "'palanquin VERSION' must be the first line"},
           {kWhole + "palanquin 2\n", "'palanquin VERSION' must be the first line"},
           {with("palanquin 2", "palanquin 1"), "this engine reads version 2"},
           {with("real 3 state", "real three state"), "'three' must be an integer of at least 1"},
           {with("real 3 state", "real -3 state"), "'-3' must be an integer"},
           {with("real 3 state", "real 3.5 state"), "'3.5' must be an integer"},
           {with("real 3 state", "real 99999999999 state"), "must be an integer"},
           {with("real 3 state", "real 16777216 state"), "the problem is too large"},
           {with("real 3 state", "complex 3 state"), "must be one of real, quaternion"},
           {with("quaternion 4", "quaternion 3"), "a quaternion has 4 entries"},
           {with("variable 2", "variable 4"), "more coordinates than entries"},
           {with("block foot", "block pose"), "block 'pose' is stated twice"},
           {with("parameter goal", "parameter dt"), "parameter 'dt' is stated twice"},
           {with("map 2 2", "map 2 2 2"), "too many entries"},
           {with("map 2 2", "map 70000 70000"), "too many entries"},
           {with("100.5", "nan"), "'nan' must be a finite number"},
           {with("100.5", "1e999"), "'1e999' must be a finite number"},
           {with("100.5", "0.0"), "scale must be positive"},
           {with("100.5", "100,5"), "'100,5' must be a finite number"},
           {with("100.5", "100.5 7"), "more words"},
           {with(" 100.5", ""), "it ends too early"},
           {with("0.05", "0.05 0.06"), "more words"},
           {with("1.5 -2e-05 0.0", "1.5"), "it ends too early"},
           {with("default goal", "default dt"), "default of 'dt' is stated twice"},
           {with("default goal", "default gaol"), "there is no parameter 'gaol'"},
           {with("hard 0.0", "soft 0.0"), "must be one of hard, c2_penalty"},
           {with("4200.5", "-1.0"), "stiffness"},
           {with("policy reach", "policy lane"), "policy of 'lane' is stated twice"},
           {with("policy reach", "policy torque"), "no policy of 'reach'"},
           {kWhole + "policy torque hard 0.0 0.0\n", "'torque' belongs to no rows"},
           {without("horizon"), "it states no horizon"},
           {without("default map"), "no default of parameter 'map'"},
           {with("horizon 30", "horizon 0"), "'0' must be an integer of at least 1"},
           {kWhole + "horizon 3\n", "horizon is stated twice"},
           {kWhole + "colour red\n", "manifest line 'colour red': 'colour' is unknown"}})
    EXPECT_NE(complaint(text).find(words), std::string::npos) << complaint(text);
}

TEST(Manifest, AnyDamageIsReadOrRefused) {
  std::mt19937 random(7);
  auto any = [&random](std::size_t size) { return random() % size; };
  for (int trial = 0; trial < 5000; ++trial) {
    std::string text = kWhole;
    for (int edit = 0; edit < 3; ++edit) {
      const std::size_t at = any(text.size());
      switch (any(3)) {
        case 0:
          text[at] = static_cast<char>(any(256));
          break;
        case 1:
          text.erase(at, any(20));
          break;
        default:
          text.insert(at, text.substr(any(text.size()), any(20)));
      }
    }
    complaint(text);
  }
}

}  // namespace
}  // namespace palanquin
