// SPDX-License-Identifier: Apache-2.0
// Which DLP controllers there are, of every kind, and what each tells about itself.
#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/dlp_link.hpp"
#include "symrig/projector/internal/dlpc350.hpp"
#include "symrig/projector/internal/dlpc900.hpp"

#include <utility>

namespace symrig {
namespace {

using projector::dlp::FoundController;

DlpController described(const FoundController& found) {
  DlpController controller;
  controller.path = found.path;
  controller.product = found.product.empty() ? std::string(found.kind.name) : found.product;
  controller.serial = found.serial;
  return controller;
}

template <class Controller>
Result<void> ask_a(const FoundController& found, DlpController& about) {
  constexpr Nanoseconds kPatience{300'000'000};
  SYMRIG_TRY(auto transport, open_transport(found.kind, found.path));
  Controller controller(std::move(transport), kPatience);
  return look(controller, about);
}

Result<void> ask(const FoundController& found, DlpController& about) {
  if (found.kind == projector::dlp::kDlpc900) return ask_a<projector::dlpc900::Controller>(found, about);
  return ask_a<projector::dlpc350::Controller>(found, about);
}

}  // namespace

std::vector<DlpController> find_dlp_controllers() {
  std::vector<DlpController> all;
  for (const FoundController& found : projector::dlp::find_controllers()) {
    DlpController one = described(found);
    if (const auto asked = ask(found, one); !asked) one.error = asked.error().line();
    all.push_back(std::move(one));
  }
  return all;
}

Result<DlpController> look_at_dlp_controller(const std::string& path) {
  for (const FoundController& found : projector::dlp::find_controllers()) {
    if (found.path != path) continue;
    DlpController controller = described(found);
    SYMRIG_CHECK(ask(found, controller));
    return controller;
  }
  return projector::dlp::missing("DLP controller", path);
}

}  // namespace symrig
