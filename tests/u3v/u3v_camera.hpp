// SPDX-License-Identifier: Apache-2.0
// A USB3 Vision camera with the features of the GigE Vision camera of tests/gige. It is a USB device for the
// server of tests/usbip. Written from public facts: the registers, packets and descriptors that Aravis and
// Wireshark read (src/arvuvcpprivate.h, src/arvuvspprivate.h; epan/dissectors/packet-u3v.c).
#pragma once

#include "gige/gige_camera.hpp"
#include "usbip/usb_device.hpp"

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>

namespace symrig::u3v {

/// What the camera says of itself on the bus.
test::UsbDescription u3v_description(const std::string& serial);

/// The camera. Not thread-safe: whoever calls it holds the server's mutex.
class U3vCamera final : public test::UsbDevice {
 public:
  /// Of the traits, it uses size, chunks, clock, binning, readout and longest_exposure.
  U3vCamera(gige::CameraTraits traits, gige::GigeCamera::Scene scene, std::string serial);

  /// A pulse on Line1. Its frame waits for the host's reads. false: the camera did not expose.
  /// mishap: as for the GigE Vision camera; a dropped frame leaves out its block id, too.
  /// ended: the stamp of the frame. None: now.
  bool pulse(std::chrono::nanoseconds width, gige::Mishap mishap = gige::Mishap::none,
             std::optional<std::chrono::nanoseconds> ended = {});
  /// A loss of power: settings and frames that wait are gone.
  void reset();
  std::uint32_t reg(std::uint32_t at) const;

  const test::UsbDescription& description() const override { return description_; }
  bool out(unsigned endpoint, std::span<const std::uint8_t> bytes) override;
  std::optional<Bytes> in(unsigned endpoint, std::size_t most) override;

 private:
  /// An exposure with its picture and chunks, ready to be sent.
  struct Exposed {
    gige::Shot shot;
    Bytes payload;
  };

  void set_bootstrap();
  void set_defaults();
  void store(std::uint32_t at, std::uint64_t value, int bytes = 4);
  void update();
  std::optional<Bytes> read(std::uint64_t at, std::size_t count) const;
  /// A status of GenCP. 0: done.
  std::uint16_t write(std::uint64_t at, std::span<const std::uint8_t> bytes);
  void written(std::uint32_t at);
  void acknowledge(std::uint16_t status, unsigned command, unsigned id, const Bytes& payload);
  bool chunks() const { return traits_.has_chunks && reg(0x10040) != 0; }
  std::size_t image_bytes() const;
  std::size_t payload_bytes() const;
  Bytes payload(const gige::Shot& shot) const;
  void send(const Exposed& exposed);

  gige::CameraTraits traits_;
  gige::GigeCamera::Scene scene_;
  std::string serial_, xml_;
  test::UsbDescription description_;
  Bytes memory_;
  std::uint32_t counter_ = 0;
  std::uint64_t next_id_ = 0;
  std::deque<Bytes> answers_;    // of the control channel
  std::deque<Bytes> transfers_;  // of the stream
  std::size_t taken_ = 0;        // bytes of the first transfer that the host has
  std::optional<Exposed> held_;  // waits for the next pulse
  bool swap_ = false;            // held_ comes after the next frame
};

}  // namespace symrig::u3v
