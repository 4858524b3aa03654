#include "palanquin/control/planning/planner_text.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "palanquin/control/planning/slots.hpp"

namespace palanquin::planning {

std::string parameters_text(const LoweredProblem& problem, const RowMatrix& values,
                            const std::function<bool(int)>& is_left_out) {
  std::string text;
  const RowMatrix defaults = default_parameters(problem, static_cast<int>(values.rows()) - 1);
  for (const ParameterInfo& p : problem.parameters()) {
    if (is_left_out(p.offset)) continue;
    const RowMatrix own = values.middleCols(p.offset, p.size);
    if (own == defaults.middleCols(p.offset, p.size)) continue;
    text += "parameter " + p.name + words(own.reshaped<Eigen::RowMajor>()) + '\n';
  }
  return text;
}

void read_parameter(TextLine& line, const LoweredProblem& problem, RowMatrix& values) {
  const std::string name = line.word();
  const ParameterInfo* p = find_parameter(problem, name);
  if (p == nullptr) throw std::runtime_error("the problem has no parameter '" + name + "'");
  for (Eigen::Index k = 0; k < values.rows(); ++k)
    for (int i = 0; i < p->size; ++i) values(k, p->offset + i) = line.number();
}

void write_planner_text(const std::string& folder, const std::string& text) {
  const std::string path = folder + "/planner";
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write '" + path + "'");
}

void read_planner_text(const std::string& folder, const std::function<void(TextLine&)>& read) {
  const std::string path = folder + "/planner";
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read '" + path + "'");
  std::stringstream text;
  text << file.rdbuf();
  const std::string content = text.str();
  for (const std::string_view statement : split(content, '\n')) {
    TextLine line(statement);
    try {
      read(line);
      line.finish();
    } catch (const std::exception& error) {
      throw std::runtime_error("'" + path + "': line " + excerpt(statement) + ": " + error.what());
    }
  }
}

}  // namespace palanquin::planning
