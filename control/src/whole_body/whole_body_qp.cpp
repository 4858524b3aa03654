// The QP of a period: unknowns are the joints' torques, the contacts' forces, the decided wrenches.
#include "palanquin/control/whole_body/whole_body_controller.hpp"

namespace palanquin {

namespace {

constexpr int kRowsPerContact = kConeSides + 2;  ///< its pyramid, the normal force's two bounds

}  // namespace

std::size_t WholeBodyController::workspace_of(std::size_t contacts, std::size_t vectors) const {
  return contacts * static_cast<std::size_t>(2 * hands_ + 1) + vectors;
}

/// One for each size that a QP may have, each used once so that nothing is left to allocate.
void WholeBodyController::make_workspaces() {
  const Eigen::Index n = model_->joints(), nv = model_->nv();
  workspaces_.resize(workspace_of(static_cast<std::size_t>(limbs_) + 1, 0));
  for (Eigen::Index contacts = 0; contacts <= limbs_; ++contacts)
    for (Eigen::Index vectors = 0; vectors <= 2 * hands_; ++vectors) {
      auto& [response, phi, qp, solver] = workspaces_[workspace_of(
          static_cast<std::size_t>(contacts), static_cast<std::size_t>(vectors))];
      const Eigen::Index unknowns = n + 3 * (contacts + vectors);
      response.setZero(nv, unknowns);
      phi.setZero(tasks_.rows(), unknowns);
      qp.H.setIdentity(unknowns, unknowns);
      qp.g.setZero(unknowns);
      qp.equalities = static_cast<int>(3 * contacts);
      qp.A.setZero(3 * contacts + 2 * n + kRowsPerContact * contacts, unknowns);
      qp.b.setZero(qp.A.rows());
      solver.solve(qp);
    }
}

void WholeBodyController::build() {
  now_ = workspace_of(contacts_.size(), static_cast<std::size_t>(vectors_));
  build_response(now());
  build_cost(now());
  build_contacts(now());
  build_limits(now().qp);
}

/// v' = response [tau; f; m] + free, from the dynamics.
void WholeBodyController::build_response(Workspace& workspace) {
  const Eigen::Index n = model_->joints();
  Eigen::MatrixXd& response = workspace.response;
  mass_.compute(model_->mass_matrix());
  response.leftCols(n).setZero();
  response.bottomLeftCorner(n, n).setIdentity();
  Eigen::Index column = n;
  const auto append = [&](const Eigen::Matrix3Xd& jacobian) {
    response.middleCols<3>(column) = jacobian.transpose();
    column += 3;
  };
  for (const Contact& contact : contacts_) append(model_->limb(contact.limb).jacobian);
  for (const Decided& wrench : decided_) {
    append(model_->limb(wrench.limb).jacobian);
    if (wrench.has_moment) append(model_->limb(wrench.limb).angular_jacobian);
  }
  mass_.solveInPlace(response);
  free_ = -bias_;
  mass_.solveInPlace(free_);
}

/// The weighted squares of slack, torques, and what forces and moments differ from the desired.
void WholeBodyController::build_cost(Workspace& workspace) {
  DenseQp& qp = workspace.qp;
  const Eigen::Index n = model_->joints();
  auto phi = workspace.phi.topRows(rows_);
  auto error = error_.head(rows_);
  phi.noalias() = tasks_.topRows(rows_) * workspace.response;
  error.noalias() = tasks_.topRows(rows_) * free_;
  error -= demand_.head(rows_);

  qp.H.setZero();
  qp.H.selfadjointView<Eigen::Lower>().rankUpdate(phi.transpose());
  qp.H.diagonal().head(n).array() += settings_.torque_weight;
  qp.g.noalias() = phi.transpose() * error;
  Eigen::Index at = n;
  const auto prefer = [&](const Vector3& desired, double weight) {
    qp.H.diagonal().segment<3>(at).array() += weight;
    qp.g.segment<3>(at) -= weight * desired;
    at += 3;
  };
  for (const Contact& contact : contacts_) prefer(contact.force, settings_.force_weight);
  for (const Decided& wrench : decided_) {
    prefer(wrench.desired.force, settings_.force_weight);
    if (wrench.has_moment) prefer(wrench.desired.moment, settings_.moment_weight);
  }
}

/// (27), with the velocity that is left in a limb damped.
void WholeBodyController::build_contacts(Workspace& workspace) const {
  DenseQp& qp = workspace.qp;
  Eigen::Index row = 0;
  for (const Contact& contact : contacts_) {
    const LimbKinematics& at = model_->limb(contact.limb);
    qp.A.middleRows<3>(row).noalias() = at.jacobian * workspace.response;
    qp.b.segment<3>(row) = -settings_.contact_damping * at.velocity - at.drift;
    qp.b.segment<3>(row).noalias() -= at.jacobian * free_;
    row += 3;
  }
}

/// Torque limits, friction pyramids, and the bounds of the normal forces.
void WholeBodyController::build_limits(DenseQp& qp) const {
  const Eigen::Index n = model_->joints();
  Eigen::Index row = qp.equalities, column = n;
  qp.A.bottomRows(qp.A.rows() - row).setZero();
  qp.b.tail(qp.b.size() - row).setZero();
  for (const double sign : {1.0, -1.0}) {  // sign tau >= -limit
    qp.A.block(row, 0, n, n).diagonal().setConstant(sign);
    qp.b.segment(row, n) = -model_->effort();
    row += n;
  }
  for (const Contact& contact : contacts_) {
    qp.A.block<kConeSides, 3>(row, column) =
        (contact.frame * cone_normals(contact.friction)).transpose();
    row += kConeSides;
    const auto normal = contact.frame.col(2).transpose();
    qp.A.block<1, 3>(row, column) = normal;
    qp.b[row++] = contact.least_force;
    qp.A.block<1, 3>(row, column) = -normal;
    qp.b[row++] = -settings_.largest_force;
    column += 3;
  }
}

}  // namespace palanquin
