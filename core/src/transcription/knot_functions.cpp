#include "transcription/knot_functions.hpp"

#include "palanquin/core/manifold.hpp"

namespace palanquin {

KnotFunctions::KnotFunctions(const TranscriptionModel& model, int threads)
    : model_(model),
      pool_(threads),
      workspaces_(size_of(threads)),
      values_(size_of(model.horizon() + 1), KnotValues(model.problem())) {
  const LoweredProblem& problem = model.problem();
  for (FunctionWorkspace& w : workspaces_) {
    for (const LoweredFunction* f :
         {&problem.structure, &problem.chart, &problem.link, &problem.link_linear})
      f->prepare(w);
    for (const auto* functions : {&problem.knot_values, &problem.knot_derivatives})
      for (const LaneFunction& f : *functions) f.prepare(w);
    if (const ExactHessian* exact = model.exact(); exact != nullptr)
      for (const LoweredFunction* f : {&exact->running, &exact->terminal}) f->prepare(w);
  }
}

void KnotFunctions::evaluate(const TranscriptionInputs& inputs,
                             const std::vector<const KnotRows*>& rows,
                             const RowMatrix& trajectory) {
  for_each_group([&](int thread, int first, int last) {
    call(thread, first, last, inputs, trajectory, model_.problem().knot_values,
         [this](int knot, KnotResult result, const double* values, int stride) {
           keep(knot, result, values, stride);
         });
    for (int knot = first; knot < last; ++knot) {
      if (knot < model_.horizon()) evaluate_defect(knot, trajectory);
      const KnotRows& wanted = *rows[size_of(knot)];
      if (wanted.link_rows.empty() && wanted.own_links.empty()) continue;
      give_link(thread, knot, inputs, trajectory);
      model_.problem().link(workspace(thread));
    }
  });
}

void KnotFunctions::evaluate_defect(int knot, const RowMatrix& trajectory) {
  KnotValues& out = values_[size_of(knot)];
  const double* next = trajectory.row(knot + 1).data();
  const double* d = out.next_state.data();
  double* rows = out.defect.data();
  for (const BlockInfo& b : model_.problem().states()) {
    if (b.is_quaternion) {
      Eigen::Map<Vector3>{rows} = quaternion_minus(Eigen::Map<const Vector4>(d),
                                                   Eigen::Map<const Vector4>(next + b.offset));
    } else {
      for (int i = 0; i < b.size; ++i) rows[i] = d[i] - next[b.offset + i];
    }
    rows += b.tangent_size;
    d += b.size;
  }
}

void KnotFunctions::give_link(int thread, int knot, const TranscriptionInputs& inputs,
                              const RowMatrix& trajectory) {
  FunctionWorkspace& w = workspace(thread);
  w.arguments[0] = knot > 0 ? trajectory.row(knot - 1).data() : inputs.measured().data();
  w.arguments[1] = trajectory.row(knot).data();
  w.arguments[2] = inputs.parameters().row(knot).data();
  w.results[0] = values_[size_of(knot)].link.data();
}

}  // namespace palanquin
