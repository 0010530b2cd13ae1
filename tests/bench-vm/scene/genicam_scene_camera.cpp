// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/scene_camera.hpp"
#include "gige/gige_camera.hpp"
#include "u3v/u3v_camera.hpp"
#include "usbip/usbip_server.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

constexpr unsigned kSpareBits = 4;  // of the device's 16, below those of the simulated sensor
// Registers of the devices: the standards leave their addresses to the maker (tests/gige/camera_xml.cpp).
constexpr std::uint32_t kWidth = 0x10000, kHeight = 0x10004, kAcquiring = 0x10018, kTriggerMode = 0x10020,
                        kExposureMode = 0x1002C;
constexpr std::uint32_t kOn = 1, kTriggerWidth = 1;

/// What both cameras can do.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  virtual std::uint32_t reg(std::uint32_t at) const = 0;
  /// false: the camera did not expose.
  virtual bool pulse(Nanoseconds width, gige::Mishap mishap, Nanoseconds stamp) = 0;
  virtual std::string report() const { return {}; }
};

using Scene = gige::GigeCamera::Scene;
/// Powers a camera on.
using PowerOn = std::function<Result<std::unique_ptr<Device>>(Scene)>;

gige::CameraTraits traits_of(Grid camera, Nanoseconds readout) {
  gige::CameraTraits traits;
  traits.rows = camera.rows;
  traits.cols = camera.cols;
  traits.readout = std::chrono::duration_cast<std::chrono::microseconds>(readout);
  traits.longest_exposure = std::chrono::seconds(30);
  traits.has_binning = false;
  return traits;
}

class GigeDevice final : public Device {
 public:
  GigeDevice(const gige::CameraTraits& traits, Scene scene) : camera_(traits, std::move(scene)) {}

  std::uint32_t reg(std::uint32_t at) const override { return camera_.reg(at); }
  bool pulse(Nanoseconds width, gige::Mishap mishap, Nanoseconds stamp) override {
    return camera_.pulse(width, mishap, stamp);
  }
  std::string report() const override {
    return fmt::format("{} packets lost, {} sent again", camera_.packets_lost(), camera_.packets_resent());
  }

 private:
  gige::GigeCamera camera_;
};

class Usb3Device final : public Device {
 public:
  Usb3Device(const Usb3Link& link, Scene scene)
      : camera_(std::make_shared<u3v::U3vCamera>(traits_of(link.camera, link.readout), std::move(scene),
                                                 link.serial)),
        server_(camera_, link.port) {}

  bool is_served() const { return server_.port() != 0; }
  std::uint32_t reg(std::uint32_t at) const override {
    const std::scoped_lock lock(server_.mutex());
    return camera_->reg(at);
  }
  bool pulse(Nanoseconds width, gige::Mishap mishap, Nanoseconds stamp) override {
    bool exposed = false;
    {
      const std::scoped_lock lock(server_.mutex());
      exposed = camera_->pulse(width, mishap, stamp);
    }
    server_.answer();  // the host's reads wait for the frame
    return exposed;
  }

 private:
  std::shared_ptr<u3v::U3vCamera> camera_;
  mutable test::UsbIpServer server_;
};

gige::Mishap mishap_of(FrameFault fault) {
  if (fault == FrameFault::late) return gige::Mishap::late;
  return fault == FrameFault::swap ? gige::Mishap::swapped : gige::Mishap::none;
}

class GenicamSceneCamera final : public SceneCamera {
 public:
  GenicamSceneCamera(Grid camera, PowerOn power_on) : camera_(camera), power_on_(std::move(power_on)) {}

  Result<Settings> settings() const override {
    if (!device_ || device_->reg(kAcquiring) == 0) return Settings{};
    if (device_->reg(kWidth) != static_cast<std::uint32_t>(camera_.cols) ||
        device_->reg(kHeight) != static_cast<std::uint32_t>(camera_.rows))
      return Error{ErrorCode::size_mismatch, "the host has set another region than the whole picture",
                   "remove camera.region from the rig file"};
    return Settings{device_->reg(kTriggerMode) == kOn && device_->reg(kExposureMode) == kTriggerWidth, false};
  }

  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    if (!device_) return CameraPort::Taken::unplugged;
    for (std::uint32_t lost = 0; lost < frame.skip; ++lost)
      device_->pulse(frame.open, gige::Mishap::frame_dropped, frame.stamp);
    codes_ = frame.codes;
    const bool exposed = device_->pulse(frame.open, mishap_of(frame.fault), frame.stamp);
    return exposed ? CameraPort::Taken::yes : CameraPort::Taken::not_streaming;
  }

  Result<void> plug(bool in) override {
    device_.reset();
    if (!in) return {};
    SYMRIG_TRY(device_,
               power_on_([this](const gige::Shot&, std::span<std::uint16_t> codes) { fill(codes); }));
    return {};
  }

  bool delays_frames() const override { return true; }
  std::string report() const override { return device_ ? device_->report() : "the camera is unplugged"; }

 private:
  void fill(std::span<std::uint16_t> codes) const {
    const std::size_t count = std::min(codes.size(), codes_->size());
    for (std::size_t i = 0; i < count; ++i) codes[i] = static_cast<std::uint16_t>((*codes_)[i] << kSpareBits);
  }

  Grid camera_;
  PowerOn power_on_;
  Codes codes_;                     // of the frame that is being exposed
  std::unique_ptr<Device> device_;  // none: unplugged
};

Result<std::unique_ptr<SceneCamera>> open_genicam(Grid grid, PowerOn power_on, const FaultRates& faults) {
  if (faults.duplicate > 0 || faults.damage > 0 || !faults.counted)
    return Error{ErrorCode::bad_argument, "a GenICam camera has no such fault here",
                 "use --drop, --drop-frame, --late, --swap, --drop-trigger, --packet-loss or --jitter"};
  auto camera = std::make_unique<GenicamSceneCamera>(grid, std::move(power_on));
  SYMRIG_CHECK(camera->plug(true));
  return std::unique_ptr<SceneCamera>(std::move(camera));
}

}  // namespace

Result<std::unique_ptr<SceneCamera>> open_gige_camera(const GigeLink& link, const FaultRates& faults) {
  if (!(link.packet_loss >= 0 && link.packet_loss < 1))
    return Error{ErrorCode::bad_argument, fmt::format("--packet-loss cannot be {}", link.packet_loss),
                 "give a share from 0 to 1"};
  gige::CameraTraits traits = traits_of(link.camera, link.readout);
  traits.address = link.address;
  traits.packet_loss = link.packet_loss;
  const PowerOn power_on = [traits](Scene scene) -> Result<std::unique_ptr<Device>> {
    try {  // it throws without a socket
      return std::unique_ptr<Device>(std::make_unique<GigeDevice>(traits, std::move(scene)));
    } catch (const std::exception& error) {
      return Error{ErrorCode::io, fmt::format("the GigE Vision camera cannot start: {}", error.what()),
                   "give a free address of the loopback network, such as 127.0.7.1"};
    }
  };
  return open_genicam(link.camera, power_on, faults);
}

Result<std::unique_ptr<SceneCamera>> open_usb3_camera(const Usb3Link& link, const FaultRates& faults) {
  const PowerOn power_on = [link](Scene scene) -> Result<std::unique_ptr<Device>> {
    auto device = std::make_unique<Usb3Device>(link, std::move(scene));
    if (device->is_served()) return std::unique_ptr<Device>(std::move(device));
    return Error{ErrorCode::io,
                 fmt::format("the USB3 Vision camera cannot start: port {} is taken", link.port),
                 "end the other device on USB/IP"};
  };
  return open_genicam(link.camera, power_on, faults);
}

}  // namespace symrig::bench_vm
