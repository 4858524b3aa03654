#include "palanquin/control/planning/bar_team.hpp"

#include <algorithm>

namespace palanquin::planning {

namespace {
bool has(const Bar& bar, int robot) { return bar.robots[0] == robot || bar.robots[1] == robot; }
}  // namespace

int BarTeam::first_row(int bar) const {
  int rows = 0;
  for (int b = 0; b < bar; ++b) rows += bars[static_cast<std::size_t>(b)].rows;
  return rows;
}

int BarTeam::rows() const { return first_row(static_cast<int>(bars.size())); }

std::vector<int> BarTeam::neighbours(int robot) const {
  std::vector<int> found;
  for (const Bar& bar : bars)
    if (has(bar, robot)) found.push_back(bar.robots[bar.robots[0] == robot ? 1 : 0]);
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

std::vector<int> BarTeam::bars_of(int robot) const {
  std::vector<int> found;
  for (int b = 0; b < static_cast<int>(bars.size()); ++b)
    if (has(bars[static_cast<std::size_t>(b)], robot)) found.push_back(b);
  return found;
}

}  // namespace palanquin::planning
