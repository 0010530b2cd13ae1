// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/projector.hpp"

namespace symrig {

Result<Shown> Projector::show(std::size_t /*index*/) {
  return Error{ErrorCode::bad_argument, describe() + " advances by its trigger line",
               "let the board advance it"};
}

Result<void> Projector::load_planes(std::span<const Pattern> /*patterns*/,
                                    std::span<const PlanePlan> /*plans*/) {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

Result<Shown> Projector::play(std::span<const std::size_t> /*order*/) {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

Result<std::vector<ShownPicture>> Projector::played() {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

std::string Projector::setting_for_planes(std::span<const int> /*seen*/) const {
  return {};
}

}  // namespace symrig
