#include "palanquin/solvers/qp_factory.hpp"

#include <stdexcept>
#include <string>

#include "elimination/qp_eliminating.hpp"
#include "hard_rows/qp_hard_rows.hpp"
#include "qp_ldl.hpp"
#include "qp_osqp.hpp"

namespace palanquin {
namespace {

struct BackEnd {
  std::string_view name;
  std::unique_ptr<QpSolver> (*make)(const QpSettings& settings);
};

constexpr BackEnd kBackEnds[] = {
    {"structured",
     [](const QpSettings& s) {
       return make_eliminating_qp_solver(make_structured_qp_solver(s.multipliers, s.structured));
     }},
    {"ldl", [](const QpSettings& s) { return make_ldl_qp_solver(s.ldl); }},
    {"osqp", [](const QpSettings& s) { return make_osqp_qp_solver(s.osqp); }},
};

}  // namespace

std::vector<std::string_view> qp_solver_names() {
  std::vector<std::string_view> names;
  for (const BackEnd& back_end : kBackEnds) names.push_back(back_end.name);
  return names;
}

std::unique_ptr<QpSolver> make_qp_solver(std::string_view name, const QpSettings& settings) {
  if (const std::string sentence = settings.explain_invalid(); !sentence.empty())
    throw std::invalid_argument(sentence);
  if (name == "multipliers")
    name = "structured";  // what the structured solver once needed for them
  std::string known;
  for (const BackEnd& back_end : kBackEnds) {
    if (back_end.name == name) return back_end.make(settings);
    known.append(known.empty() ? "" : ", ").append(back_end.name);
  }
  throw std::invalid_argument("QP solver is '" + std::string(name) + "', but must be one of " +
                              known);
}

}  // namespace palanquin
