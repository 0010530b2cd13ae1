// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/controller_on_usb.hpp"

#include "dlpc/controller_on_usb.hpp"
#include "dlpc/emulated_dlpc350.hpp"

#include <cmath>
#include <mutex>
#include <utility>

namespace symrig::bench_vm {

namespace {

struct Controller {
  std::shared_ptr<test::EmulatedController> device = std::make_shared<test::EmulatedDlpc350>();
  test::UsbIpServer server{test::on_usb(device)};
};

Nanoseconds microseconds(std::uint32_t us) {
  return Nanoseconds{1000 * std::int64_t{us}};
}

}  // namespace

PlaneWatch::Controller serve_controller() {
  return [controller = std::make_shared<Controller>()]() -> std::optional<ShownSequence> {
    const std::scoped_lock lock(controller->server.mutex());
    if (!controller->device->shows_sequence()) return std::nullopt;
    auto sequence = controller->device->sequence();
    return ShownSequence{std::move(sequence.patterns), microseconds(sequence.period_us),
                         microseconds(sequence.exposure_us),
                         Nanoseconds{std::llround(1e3 * sequence.frame_lead_us)}};
  };
}

}  // namespace symrig::bench_vm
