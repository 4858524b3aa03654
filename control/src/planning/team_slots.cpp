#include "palanquin/control/planning/team_slots.hpp"

#include <algorithm>
#include <stdexcept>

#include "palanquin/control/planning/slots.hpp"

namespace palanquin::planning {

namespace {
constexpr const char* kParts[4] = {"position", "orientation", "velocity", "angular_velocity"};
constexpr int kPartOffsets[4] = {0, 3, 7, 10};  // in a body's state
constexpr int kPartSizes[4] = {3, 4, 3, 3};
}  // namespace

TeamSlots::TeamSlots(const LoweredProblem& problem, const Team& team, const Terrain& terrain) {
  std::vector<std::string> names = {"payload"};
  for (const Carrier& carrier : team.carriers) names.push_back(carrier.name);
  for (const std::string& body : names) {
    Parts z, p;
    for (int i = 0; i < 4; ++i) {
      z[i] = block_slot(problem, body + "." + kParts[i], kPartSizes[i]);
      p[i] = parameter_slot(problem, body + ".reference." + kParts[i], kPartSizes[i]);
    }
    bodies.push_back(z);
    references_.push_back(p);
    external_.push_back({parameter_slot(problem, body + ".external_force", 3),
                         parameter_slot(problem, body + ".external_torque", 3)});
    inertials_.push_back({parameter_slot(problem, body + ".mass", 1),
                          parameter_slot(problem, body + ".inertia", 3)});
  }
  const std::vector<LocalParameter> local = terrain.local_parameters();
  for (const LocalParameter& l : local) ground_size_ += l.size;
  for (const Carrier& carrier : team.carriers) {
    const std::string& robot = carrier.name;
    hands.push_back({block_slot(problem, robot + ".hand.force", 3),
                     block_slot(problem, robot + ".hand.torque", 3)});
    footholds_.push_back(parameter_slot(problem, robot + ".reference.footholds", 3 * kFeet));
    contacts_.push_back(parameter_slot(problem, robot + ".contact", kFeet));
    previous_.push_back(parameter_slot(problem, robot + ".previous_contact", kFeet));
    for (const char* limb : kFootNames) {
      const std::string foot = robot + "." + limb;
      feet.push_back(block_slot(problem, foot + ".foot", 3));
      forces.push_back(block_slot(problem, foot + ".force", 3));
      if (local.empty()) continue;
      ground_.emplace_back();
      for (const LocalParameter& l : local)
        ground_.back().emplace_back(parameter_slot(problem, foot + ".ground." + l.name, l.size),
                                    l.size);
    }
  }
  spacing_ = parameter_slot(problem, "dt", 1);
  if (const ParameterInfo* p = find_parameter(problem, "ditches")) {
    ditches_ = p->offset;
    most_ditches_ = p->size / 4;
  }
  values_.resize(static_cast<std::size_t>(ground_size_));
}

bool TeamSlots::is_written(int offset) const {
  const auto has = [offset](const auto& offsets) {
    return std::find(offsets.begin(), offsets.end(), offset) != offsets.end();
  };
  const auto is_ground = [offset](const auto& foot) {
    return std::any_of(foot.begin(), foot.end(), [&](const auto& p) { return p.first == offset; });
  };
  return offset == ditches_ || has(footholds_) || has(contacts_) || has(previous_) ||
         std::any_of(references_.begin(), references_.end(), has) ||
         std::any_of(external_.begin(), external_.end(), has) ||
         std::any_of(ground_.begin(), ground_.end(), is_ground);
}

void TeamSlots::add_wrench(const Eigen::RowVectorXd& wrench, int body,
                           Eigen::VectorXd& parameters) const {
  const auto [force, torque] = external_[static_cast<std::size_t>(body)];
  parameters.segment<3>(force) += wrench.head<3>().transpose();
  parameters.segment<3>(torque) += wrench.tail<3>().transpose();
}

Inertial TeamSlots::inertial(const RowMatrix& parameters, int body) const {
  const auto [mass, moments] = inertials_[static_cast<std::size_t>(body)];
  return {parameters(0, mass), parameters.row(0).segment<3>(moments).transpose()};
}

void TeamSlots::read_bodies(const double* z, double* states) const {
  for (const Parts& parts : bodies) {
    for (int i = 0; i < 4; ++i) std::copy_n(z + parts[i], kPartSizes[i], states + kPartOffsets[i]);
    states += kState;
  }
}

void TeamSlots::write_bodies(const double* states, double* z) const {
  for (const Parts& parts : bodies) {
    for (int i = 0; i < 4; ++i) std::copy_n(states + kPartOffsets[i], kPartSizes[i], z + parts[i]);
    states += kState;
  }
}

void TeamSlots::write_measured(const TeamState& state, double* z) const {
  write_bodies(state.bodies.data(), z);
  for (std::size_t i = 0; i < feet.size(); ++i)
    std::copy_n(&state.feet(static_cast<Eigen::Index>(i), 0), 3, z + feet[i]);
}

void TeamSlots::write_instant(const Instant& now, RowMatrix& parameters) const {
  for (Eigen::Index k = 0; k < parameters.rows(); ++k) {
    double* p = &parameters(k, 0);
    const double* state = &now.references.bodies(k, 0);
    for (const Parts& parts : references_) {
      for (int i = 0; i < 4; ++i) std::copy_n(state + kPartOffsets[i], kPartSizes[i], p + parts[i]);
      state += kState;
    }
    const auto before = k == 0 ? now.before.row(0) : now.contacts.row(k - 1);
    for (std::size_t r = 0; r < footholds_.size(); ++r) {
      const auto first = static_cast<Eigen::Index>(kFeet * r);
      std::copy_n(&now.references.footholds(k, 3 * first), 3 * kFeet, p + footholds_[r]);
      for (int f = 0; f < kFeet; ++f) {
        p[contacts_[r] + f] = now.contacts(k, first + f) ? 1.0 : 0.0;
        p[previous_[r] + f] = before[first + f] ? 1.0 : 0.0;
      }
    }
  }
}

void TeamSlots::write_ground(const Terrain& terrain, const RowMatrix& guess,
                             RowMatrix& parameters) const {
  for (Eigen::Index k = 0; k < parameters.rows(); ++k)
    for (std::size_t i = 0; i < ground_.size(); ++i) {
      terrain.around(Eigen::Map<const Vector3>(&guess(k, feet[i])), values_.data());
      const double* from = values_.data();
      for (const auto& [offset, size] : ground_[i]) {
        std::copy_n(from, size, &parameters(k, offset));
        from += size;
      }
    }
}

void TeamSlots::write_wrenches(MatrixView wrenches, RowMatrix& parameters) const {
  const auto bodies_count = static_cast<Eigen::Index>(bodies.size());
  if (wrenches.rows() != parameters.rows() || wrenches.cols() != 6 * bodies_count)
    throw std::invalid_argument("wrenches are [" + std::to_string(wrenches.rows()) + ", " +
                                std::to_string(wrenches.cols()) + "]; [" +
                                std::to_string(parameters.rows()) + ", " +
                                std::to_string(6 * bodies_count) + "] are needed");
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (std::size_t part = 0; part < 2; ++part)
      parameters.middleCols<3>(external_[b][part]) =
          wrenches.middleCols<3>(static_cast<Eigen::Index>(6 * b + 3 * part));
}

}  // namespace palanquin::planning
