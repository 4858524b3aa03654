#include "palanquin/core/manifest.hpp"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "palanquin/core/text_lines.hpp"

namespace palanquin {

namespace {

constexpr int kManifestVersion = 2;
constexpr int kLargestSize = TextLine::kLargestInteger;

using Line = TextLine;

template <typename Named>
bool has_name(const std::vector<Named>& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(), [&](const Named& n) { return n.name == name; });
}

void refuse_repetition(bool is_repeated, const std::string& what) {
  if (is_repeated) throw std::runtime_error(what + " is stated twice");
}

void read_block(Line& line, Manifest& to) {
  BlockInfo b;
  b.name = line.word();
  b.is_quaternion = line.choice({"real", "quaternion"}) == 1;
  b.size = line.integer(1);
  b.is_state = line.choice({"variable", "state"}) == 1;
  b.chart_size = line.integer(0);
  refuse_repetition(has_name(to.blocks, b.name), "block '" + b.name + "'");
  if (b.is_quaternion && b.size != 4) throw std::runtime_error("a quaternion has 4 entries");
  if (b.chart_size > b.size)
    throw std::runtime_error("its chart has more coordinates than entries");
  b.tangent_size = b.is_quaternion ? 3 : b.size;
  if (!to.blocks.empty()) {
    const BlockInfo& last = to.blocks.back();
    b.offset = last.offset + last.size;
    b.tangent_offset = last.tangent_offset + last.tangent_size;
    b.slope_offset = last.slope_offset + last.size * last.chart_size;
  }
  to.blocks.push_back(b);
}

void read_parameter(Line& line, Manifest& to) {
  ParameterInfo p;
  p.name = line.word();
  refuse_repetition(has_name(to.parameters, p.name), "parameter '" + p.name + "'");
  p.size = 1;
  while (!line.is_at_end() || p.shape.empty()) {
    p.shape.push_back(line.integer(1));
    if (p.shape.size() > 2 || p.size > kLargestSize / p.shape.back())
      throw std::runtime_error("it has too many entries");
    p.size *= p.shape.back();
  }
  if (!to.parameters.empty()) p.offset = to.parameters.back().offset + to.parameters.back().size;
  to.parameters.push_back(p);
}

void read_rows(Line& line, Manifest& to) {
  RowGroup r;
  const auto stage = static_cast<std::size_t>(line.choice({"running", "terminal"}));
  const auto kind = static_cast<std::size_t>(line.choice({"equality", "inequality", "link"}));
  auto owner = [&line] {
    const std::string name = line.word();
    return name == "-" ? std::string() : name;
  };
  r.family = line.word();
  r.robot = owner();
  r.limb = owner();
  r.size = line.integer(1);
  r.implied = line.integer(0) != 0;
  r.scale = line.number();
  if (r.scale <= 0.0) throw std::runtime_error("its scale must be positive");
  auto& groups = to.rows[stage][kind];
  if (!groups.empty()) r.offset = groups.back().offset + groups.back().size;
  groups.push_back(r);
}

void read_default(Line& line, Manifest& to) {
  const std::string name = line.word();
  const auto p = std::find_if(to.parameters.begin(), to.parameters.end(),
                              [&](const ParameterInfo& info) { return info.name == name; });
  if (p == to.parameters.end()) throw std::runtime_error("there is no parameter '" + name + "'");
  refuse_repetition(!p->defaults.empty(), "default of '" + name + "'");
  for (int i = 0; i < p->size; ++i) p->defaults.push_back(line.number());
}

void read_policy(Line& line, Manifest& to) {
  const std::string family = line.word();
  Policy policy;
  policy.kind = static_cast<PolicyKind>(
      line.choice({"hard", "c2_penalty", "squared_hinge", "relaxed_barrier"}));
  policy.stiffness = line.number();
  policy.smoothing = line.number();
  if (const std::string reason = policy.explain_invalid(); !reason.empty())
    throw std::runtime_error(reason);
  refuse_repetition(!to.policies.emplace(family, policy).second, "policy of '" + family + "'");
}

void read_version(Line& line) {
  const int version = line.integer(0);
  if (version != kManifestVersion)
    throw std::runtime_error("this engine reads version " + std::to_string(kManifestVersion) +
                             ": lower the problem again");
}

void read_line(Line& line, Manifest& to) {
  const std::string key = line.word();
  if (to.structure.empty() != (key == "palanquin"))
    throw std::runtime_error("'palanquin VERSION' must be the first line");
  auto once = [&](std::string& target) {
    refuse_repetition(!target.empty(), key);
    target = line.word();
  };
  if (key == "palanquin") {
    read_version(line);
  } else if (key == "content") {
    once(to.content);
  } else if (key == "name") {
    once(to.name);
  } else if (key == "block") {
    read_block(line, to);
  } else if (key == "parameter") {
    read_parameter(line, to);
  } else if (key == "rows") {
    read_rows(line, to);
  } else if (key == "horizon") {
    refuse_repetition(to.horizon != 0, key);
    to.horizon = line.integer(1);
  } else if (key == "default") {
    read_default(line, to);
  } else if (key == "policy") {
    read_policy(line, to);
  } else {
    throw std::runtime_error("'" + key + "' is unknown");
  }
}

/// Whether a line states what may change without lowering.
bool is_changeable(std::string_view line) {
  return line.starts_with("horizon ") || line.starts_with("default ") ||
         line.starts_with("policy ");
}

/// Numbers in a knot's vectors and matrices, as far as the last line has added to them.
long long entries(const Manifest& m) {
  long long sum = 0;
  if (!m.blocks.empty()) {
    const BlockInfo& b = m.blocks.back();
    sum += b.offset + b.size + b.slope_offset + static_cast<long long>(b.size) * b.chart_size;
  }
  if (!m.parameters.empty()) sum += m.parameters.back().offset + m.parameters.back().size;
  for (const auto& stage : m.rows)
    for (const auto& groups : stage)
      if (!groups.empty()) sum += groups.back().offset + groups.back().size;
  return sum;
}

/// What no single line can be blamed for.
std::string explain_incomplete(const Manifest& m) {
  if (m.name.empty()) return "it states no name";
  if (m.content.empty()) return "it states no content";
  if (m.horizon == 0) return "it states no horizon";
  if (std::none_of(m.blocks.begin(), m.blocks.end(), [](const BlockInfo& b) { return b.is_state; }))
    return "it states no state";
  for (const ParameterInfo& p : m.parameters)
    if (p.defaults.empty()) return "it states no default of parameter '" + p.name + "'";
  std::map<std::string, bool> families;
  for (const auto& stage : m.rows)
    for (const RowGroup& r : stage[static_cast<std::size_t>(RowKind::Inequality)]) {
      families[r.family] = true;
      if (!m.policies.contains(r.family)) return "it states no policy of '" + r.family + "'";
    }
  for (const auto& [family, policy] : m.policies)
    if (!families.contains(family)) return "its policy of '" + family + "' belongs to no rows";
  return "";
}

}  // namespace

Manifest parse_manifest(const std::string& text, const std::string& source) {
  Manifest manifest;
  for (const std::string_view content : split(text, '\n')) {
    Line line(content);
    try {
      read_line(line, manifest);
      line.finish();
      if (entries(manifest) > kLargestSize) throw std::runtime_error("the problem is too large");
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("'" + source + "': manifest line " + excerpt(content) + ": " +
                               error.what());
    }
    if (!is_changeable(content)) manifest.structure.append(content) += '\n';
  }
  if (const std::string reason = explain_incomplete(manifest); !reason.empty())
    throw std::runtime_error("'" + source + "' holds no whole manifest: " + reason);
  return manifest;
}

}  // namespace palanquin
