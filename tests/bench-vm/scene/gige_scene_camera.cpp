// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/gige_scene_camera.hpp"

#include "gige/gige_camera.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

constexpr unsigned kSpareBits = 4;  // of the device's 16, below those of the simulated sensor
// Registers of the device: GigE Vision leaves their addresses to the maker (tests/gige/camera_xml.cpp).
constexpr std::uint32_t kWidth = 0x10000, kHeight = 0x10004, kAcquiring = 0x10018, kTriggerMode = 0x10020,
                        kExposureMode = 0x1002C;
constexpr std::uint32_t kOn = 1, kTriggerWidth = 1;

class GigeSceneCamera final : public SceneCamera {
 public:
  explicit GigeSceneCamera(GigeLink link) : link_(std::move(link)) {}

  Result<Settings> settings() const override {
    if (!device_ || device_->reg(kAcquiring) == 0) return Settings{};
    if (device_->reg(kWidth) != static_cast<std::uint32_t>(link_.camera.cols) ||
        device_->reg(kHeight) != static_cast<std::uint32_t>(link_.camera.rows))
      return Error{ErrorCode::size_mismatch, "the host has set another region than the whole picture",
                   "remove camera.region from the rig file"};
    return Settings{device_->reg(kTriggerMode) == kOn && device_->reg(kExposureMode) == kTriggerWidth, false};
  }

  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    if (!device_) return CameraPort::Taken::unplugged;
    for (std::uint32_t lost = 0; lost < frame.skip; ++lost)
      device_->pulse(frame.open, gige::Mishap::frame_dropped, frame.stamp);
    codes_ = frame.codes;
    const bool sent = device_->pulse(frame.open, gige::Mishap::none, frame.stamp);
    return sent ? CameraPort::Taken::yes : CameraPort::Taken::not_streaming;
  }

  Result<void> plug(bool in) override {
    device_.reset();
    if (!in) return {};
    gige::CameraTraits traits;
    traits.address = link_.address;
    traits.rows = link_.camera.rows;
    traits.cols = link_.camera.cols;
    traits.readout = std::chrono::duration_cast<std::chrono::microseconds>(link_.readout);
    traits.longest_exposure = std::chrono::seconds(30);
    traits.packet_loss = link_.packet_loss;
    traits.has_binning = false;
    try {  // it throws without a socket
      device_ = std::make_unique<gige::GigeCamera>(
          traits, [this](const gige::Shot&, std::span<std::uint16_t> codes) { fill(codes); });
    } catch (const std::exception& error) {
      return Error{ErrorCode::io, fmt::format("the GigE Vision camera cannot start: {}", error.what()),
                   "give a free address of the loopback network, such as 127.0.7.1"};
    }
    return {};
  }

  std::string report() const override {
    if (!device_) return "the camera is unplugged";
    return fmt::format("{} packets lost, {} sent again", device_->packets_lost(), device_->packets_resent());
  }

 private:
  void fill(std::span<std::uint16_t> codes) const {
    const std::size_t count = std::min(codes.size(), codes_->size());
    for (std::size_t i = 0; i < count; ++i) codes[i] = static_cast<std::uint16_t>((*codes_)[i] << kSpareBits);
  }

  GigeLink link_;
  Codes codes_;                               // of the frame that is being sent
  std::unique_ptr<gige::GigeCamera> device_;  // none: unplugged
};

}  // namespace

Result<std::unique_ptr<SceneCamera>> open_gige_camera(const GigeLink& link, const FaultRates& faults) {
  if (faults.duplicate > 0 || faults.late > 0 || faults.swap > 0 || faults.damage > 0 || !faults.counted)
    return Error{ErrorCode::bad_argument, "a GigE Vision camera has no such fault here",
                 "use --drop, --drop-frame, --packet-loss or --jitter"};
  if (!(link.packet_loss >= 0 && link.packet_loss < 1))
    return Error{ErrorCode::bad_argument, fmt::format("--packet-loss cannot be {}", link.packet_loss),
                 "give a share from 0 to 1"};
  auto camera = std::make_unique<GigeSceneCamera>(link);
  SYMRIG_CHECK(camera->plug(true));
  return std::unique_ptr<SceneCamera>(std::move(camera));
}

}  // namespace symrig::bench_vm
