#include "palanquin/core/lowered_problem.hpp"

#include <sstream>
#include <stdexcept>

namespace palanquin {

namespace {
constexpr int kManifestVersion = 1;
}

LoweredProblem::LoweredProblem(const std::string& path) : library_(path) {
  auto manifest = reinterpret_cast<const char* (*)()>(library_.symbol("palanquin_manifest"));
  parse_manifest(manifest());
  structure = LoweredFunction(library_, "structure");
  chart = LoweredFunction(library_, "chart");
  running = LoweredFunction(library_, "running");
  running_linear = LoweredFunction(library_, "running_linear");
  terminal = LoweredFunction(library_, "terminal");
  terminal_linear = LoweredFunction(library_, "terminal_linear");
  link = LoweredFunction(library_, "link");
  link_linear = LoweredFunction(library_, "link_linear");
  knot_values = {LaneFunction(library_, "running"), LaneFunction(library_, "terminal")};
  knot_derivatives = {LaneFunction(library_, "running_linear"),
                      LaneFunction(library_, "terminal_linear")};
}

void LoweredProblem::parse_manifest(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  int slopes = 0;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "palanquin") {
      int version = 0;
      words >> version;
      if (version != kManifestVersion)
        throw std::runtime_error("'" + path() + "' has manifest version " +
                                 std::to_string(version) + "; this engine reads " +
                                 std::to_string(kManifestVersion) + ": lower the problem again");
    } else if (key == "name") {
      words >> name_;
    } else if (key == "block") {
      BlockInfo b;
      std::string manifold, kind;
      words >> b.name >> manifold >> b.size >> kind >> b.chart_size;
      b.is_quaternion = manifold == "quaternion";
      b.is_state = kind == "state";
      b.slope_offset = slopes;
      slopes += b.size * b.chart_size;
      add_block(b);
    } else if (key == "parameter") {
      ParameterInfo p;
      words >> p.name >> p.size;
      p.offset = np_;
      np_ += p.size;
      parameters_.push_back(p);
    } else if (key == "rows") {
      RowGroup r;
      std::string at, kind;
      int implied = 0;
      words >> at >> kind >> r.family >> r.robot >> r.limb >> r.size >> implied >> r.scale;
      r.implied = implied != 0;
      if (r.robot == "-") r.robot.clear();
      if (r.limb == "-") r.limb.clear();
      const StageKind stage = at == "running" ? StageKind::Running : StageKind::Terminal;
      const RowKind row_kind = kind == "equality"     ? RowKind::Equality
                               : kind == "inequality" ? RowKind::Inequality
                                                      : RowKind::Link;
      r.offset = row_count(stage, row_kind);
      rows_[static_cast<std::size_t>(stage)][static_cast<std::size_t>(row_kind)].push_back(r);
    } else {
      throw std::runtime_error("'" + path() + "': unknown manifest line '" + line + "'");
    }
    if (words.fail())
      throw std::runtime_error("'" + path() + "': malformed manifest line '" + line + "'");
  }
}

/// Appends a block to the knot vector.
void LoweredProblem::add_block(BlockInfo block) {
  block.tangent_size = block.is_quaternion ? 3 : block.size;
  block.offset = nz_;
  block.tangent_offset = ndz_;
  nz_ += block.size;
  ndz_ += block.tangent_size;
  if (block.is_state) {
    nx_ += block.size;
    ndx_ += block.tangent_size;
    states_.push_back(block);
  }
  if (block.is_quaternion)
    quaternions_.push_back(block);
  else if (blocks_.empty() || blocks_.back().is_quaternion)
    vector_runs_.push_back({block.offset, block.tangent_offset, block.size});
  else
    vector_runs_.back().size += block.size;
  blocks_.push_back(std::move(block));
}

int LoweredProblem::row_count(StageKind stage, RowKind kind) const {
  const auto& groups = rows(stage, kind);
  return groups.empty() ? 0 : groups.back().offset + groups.back().size;
}

const BlockInfo& LoweredProblem::block(const std::string& name) const {
  std::string known;
  for (const BlockInfo& b : blocks_) {
    if (b.name == name) return b;
    known += (known.empty() ? "" : ", ") + b.name;
  }
  throw std::invalid_argument("problem '" + name_ + "' has no block '" + name + "'; it has " +
                              known);
}

std::string LoweredProblem::row_name(StageKind stage, RowKind kind, int row, int knot) const {
  for (const RowGroup& g : rows(stage, kind)) {
    if (row >= g.offset + g.size) continue;
    std::string text = g.family + " (";
    if (!g.robot.empty()) text += "robot " + g.robot + ", ";
    if (!g.limb.empty()) text += "limb " + g.limb + ", ";
    return text + "row " + std::to_string(row - g.offset) + ", knot " + std::to_string(knot) + ")";
  }
  throw std::invalid_argument("row_name: row " + std::to_string(row) + " does not exist");
}

std::string LoweredProblem::dynamics_name(int row, int knot) const {
  for (const BlockInfo& b : states_) {
    if (row < b.size)
      return "dynamics of " + b.name + "[" + std::to_string(row) + "] (knot " +
             std::to_string(knot) + ")";
    row -= b.size;
  }
  throw std::invalid_argument("dynamics_name: row " + std::to_string(row) + " does not exist");
}

}  // namespace palanquin
