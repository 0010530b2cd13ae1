// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/controller_on_usb.hpp"

#include "dlpc/controller_on_usb.hpp"
#include "dlpc/emulated_controller.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <mutex>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

using Kind = ControllerFault::Kind;

constexpr std::size_t kBadEntry = 5;  // of the pattern table
constexpr int kStalled = 3;           // commands
constexpr std::array<std::pair<std::string_view, Kind>, 4> kKinds{
    {{"table", Kind::table}, {"reset", Kind::reset}, {"stall", Kind::stall}, {"hang", Kind::hang}}};

Nanoseconds from_us(std::uint32_t us) {
  return Nanoseconds{1000 * std::int64_t{us}};
}

std::shared_ptr<test::EmulatedController> controller_named(const std::string& kind) {
  if (kind == "dlpc350") return std::make_shared<test::EmulatedDlpc350>();
  if (kind == "dlpc900") return std::make_shared<test::EmulatedDlpc900>();
  return nullptr;
}

class ServedController final : public SceneController {
 public:
  ServedController(std::shared_ptr<test::EmulatedController> device, std::vector<ControllerFault> faults,
                   std::uint16_t port)
      : device_(std::move(device)), faults_(std::move(faults)), server_(test::on_usb(device_), port) {}

  bool is_served() const { return server_.port() != 0; }

  std::optional<ShownSequence> next_refresh(std::uint64_t exposures) override {
    const std::scoped_lock lock(server_.mutex());
    if (std::exchange(breaks_off_, false)) device_->reset();
    while (begun_ < faults_.size() && !lasting_ && exposures >= power_on_ + faults_[begun_].after)
      begin(faults_[begun_++].kind);
    if (!device_->shows_sequence()) return std::nullopt;
    auto sequence = device_->sequence();
    // A reset comes in the middle of the next refresh. Its commands are lost a little before its light.
    if (breaks_off_) sequence.patterns.resize(sequence.patterns.size() / 2);
    return ShownSequence{std::move(sequence.patterns), from_us(sequence.period_us),
                         from_us(sequence.exposure_us),
                         Nanoseconds{std::llround(1e3 * sequence.frame_lead_us)}, sequence.frames_all};
  }

  void cycle_power(std::uint64_t exposures) override {
    const std::scoped_lock lock(server_.mutex());
    breaks_off_ = lasting_ = false;
    device_->stalled = 0;
    device_->bad_entry.reset();
    device_->reset();
    power_on_ = exposures;
  }

  std::size_t faults() const override {
    const std::scoped_lock lock(server_.mutex());
    return begun_;
  }

 private:
  void begin(Kind fault) {
    lasting_ = fault == Kind::table || fault == Kind::hang;
    if (fault == Kind::table) device_->bad_entry = kBadEntry;
    if (fault == Kind::reset) breaks_off_ = true;
    if (fault == Kind::stall) device_->stalled = kStalled;
    if (fault == Kind::hang) device_->stalled = std::numeric_limits<int>::max();
  }

  std::shared_ptr<test::EmulatedController> device_;
  std::vector<ControllerFault> faults_;
  std::size_t begun_ = 0;
  std::uint64_t power_on_ = 0;  // exposures before it
  bool lasting_ = false;        // a fault that only a cycle of the power ends
  bool breaks_off_ = false;     // it is reset in the refresh that was last asked for
  mutable test::UsbIpServer server_;
};

}  // namespace

Result<ControllerFault> parse_controller_fault(const std::string& text) {
  const auto at = text.find('@');
  for (const auto& [name, kind] : kKinds) {
    if (at == std::string::npos || text.substr(0, at) != name) continue;
    ControllerFault fault{kind, 0};
    const char* const end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data() + at + 1, end, fault.after);
    if (error == std::errc() && stopped == end) return fault;
  }
  return Error{ErrorCode::bad_argument, fmt::format("--controller-fault cannot be '{}'", text),
               "give table, reset, stall or hang with a number of exposures, such as reset@40"};
}

Result<std::shared_ptr<SceneController>> SceneController::serve(const std::string& kind,
                                                                std::vector<ControllerFault> faults,
                                                                std::uint16_t port) {
  auto device = controller_named(kind);
  if (!device)
    return Error{ErrorCode::bad_argument, fmt::format("--planes cannot be '{}'", kind),
                 "give dlpc350 or dlpc900"};
  auto controller = std::make_shared<ServedController>(std::move(device), std::move(faults), port);
  if (controller->is_served()) return std::shared_ptr<SceneController>(std::move(controller));
  return Error{ErrorCode::io, fmt::format("the controller cannot start: port {} is taken", port),
               "end the other device on USB/IP"};
}

}  // namespace symrig::bench_vm
