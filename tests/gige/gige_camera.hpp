// SPDX-License-Identifier: Apache-2.0
// A GigE Vision camera on the loopback network, in the test's own process. Written from the public facts of
// the standard: GVCP registers and commands, GVSP packets of version 1.x, GenICam XML.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <netinet/in.h>

namespace symrig::gige {

using Bytes = std::vector<std::uint8_t>;

/// What goes wrong with one trigger pulse.
enum class Mishap : std::uint8_t {
  none,
  trigger_dropped,  ///< the camera does not see the pulse
  frame_dropped,    ///< the camera counts the pulse and sends nothing
  late,             ///< the frame is sent with the next pulse, before its frame
  swapped           ///< the frame is sent with the next pulse, after its frame
};

/// One exposure.
struct Shot {
  std::uint32_t counter = 0;  ///< trigger counter
  std::chrono::nanoseconds exposure{};
  std::chrono::nanoseconds stamp{};  ///< the end of the exposure
  int rows = 0, cols = 0, top = 0, left = 0;
};

/// How the camera and its link are.
struct CameraTraits {
  std::string address;  ///< on the loopback network; empty: another one in each process and for each camera
  int rows = 64, cols = 64;
  std::uint16_t first_id = 1;  ///< block id of the first frame
  bool has_chunks = true;
  bool has_clock = true;  ///< a time stamp that can be latched
  /// Block ids count the frames as they are sent, so ids do not show that frames were swapped. false: as they
  /// were exposed.
  bool ids_when_sent = true;
  bool has_binning = true;
  bool can_overlap = true;  ///< TriggerOverlap has an entry beside Off
  /// ExposureOverlapTimeMax. None: it has no such node.
  std::optional<std::chrono::microseconds> longest_overlap;
  bool discoverable = false;  ///< answers broadcasts on the loopback network
  std::chrono::microseconds readout = std::chrono::milliseconds(4);
  std::chrono::microseconds longest_exposure = std::chrono::seconds(1);
  double packet_loss = 0;  ///< share of stream packets that are lost, those sent again too
  bool resends = true;
  std::chrono::milliseconds pending{0};     ///< how long a register's write takes, told by PENDING_ACK
  std::chrono::microseconds packet_gap{0};  ///< a slow link
};

/// The camera. The thread that calls pulse() is its trigger line.
class GigeCamera {
 public:
  /// Fills the codes of a picture, 16 bits deep; formats of fewer bits take the upper ones.
  using Scene = std::function<void(const Shot&, std::span<std::uint16_t>)>;

  GigeCamera(CameraTraits traits, Scene scene);
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;
  ~GigeCamera();

  /// Its address.
  const std::string& address() const { return address_; }
  /// A pulse on Line1. The picture is sent before it returns. false: the camera did not expose.
  /// ended: the stamp of the frame, for a rig in virtual time. None: now.
  bool pulse(std::chrono::nanoseconds width, Mishap mishap = Mishap::none,
             std::optional<std::chrono::nanoseconds> ended = {});
  /// Forgets its settings and its controller, as after a loss of power.
  void reboot();
  void set_packet_loss(double share) { loss_ = share; }
  std::uint32_t reg(std::uint32_t at) const;
  std::uint64_t packets_lost() const { return lost_; }
  std::uint64_t packets_resent() const { return resent_; }

 private:
  struct Block {
    std::uint16_t id = 0;
    std::vector<Bytes> packets;
  };

  /// An exposure with its picture, ready to be sent.
  struct Exposed {
    Shot shot;
    Bytes picture;
    std::uint16_t id = 0;
  };

  void serve();
  void receive(int socket);
  void answer(std::span<const std::uint8_t> request, const sockaddr_in& from);
  Bytes discovery() const;
  bool write(std::uint32_t at, std::uint32_t value, const sockaddr_in& from);
  std::uint32_t read(std::uint32_t at) const;
  void store(std::uint32_t at, std::uint32_t value);
  void reply(std::uint16_t status, std::uint16_t command, std::uint16_t id, const Bytes& payload,
             const sockaddr_in& to) const;
  void resend(std::uint16_t id, std::uint32_t first, std::uint32_t last);
  void set_defaults();
  std::size_t image_bytes() const;
  std::size_t payload_bytes() const;
  Bytes picture(const Shot& shot) const;
  std::uint16_t take_id();
  void send(Exposed exposed);
  void transmit(const Bytes& packet);
  bool chunks() const { return traits_.has_chunks && read(0x10040) != 0; }

  CameraTraits traits_;
  Scene scene_;
  std::string address_, xml_;
  int control_ = -1, stream_ = -1, broadcast_ = -1;
  mutable std::mutex mutex_;
  Bytes memory_;
  std::optional<sockaddr_in> controller_;
  std::chrono::steady_clock::time_point heard_;
  std::uint32_t counter_ = 0;
  std::uint16_t next_id_ = 1;
  std::deque<Block> sent_;
  std::optional<Exposed> held_;  // waits for the next pulse
  bool swap_ = false;            // held_ comes after the next frame
  std::atomic<double> loss_;
  std::atomic<std::uint64_t> lost_ = 0, resent_ = 0;
  std::mt19937 random_{7};  // NOLINT: the same losses each time
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

/// How a camera is reached. The USB3 Vision camera (tests/u3v) has the same features.
enum class Protocol : std::uint8_t { gige_vision, usb3_vision };

/// The camera's description of itself.
std::string camera_xml(const CameraTraits& traits, Protocol protocol = Protocol::gige_vision);
/// A picture of codes of 16 bits, in a format of PFNC's number. Formats of fewer bits take the upper ones.
Bytes packed(std::span<const std::uint16_t> codes, std::uint32_t format);

// Pictures that tell which trigger they are of.

/// The first pixel is the trigger's count, the second the exposure in µs, the rest depend on both and on the
/// place, so any mixture of two pictures is found.
inline std::uint16_t numbered_code(const Shot& shot, std::size_t k) {
  if (k == 0) return static_cast<std::uint16_t>(shot.counter);
  if (k == 1) return static_cast<std::uint16_t>(shot.exposure / std::chrono::microseconds(1));
  return static_cast<std::uint16_t>(2654435761U * (shot.counter + 77U * static_cast<unsigned>(k)) >> 16U);
}

inline void numbered_scene(const Shot& shot, std::span<std::uint16_t> codes) {
  for (std::size_t k = 0; k < codes.size(); ++k) codes[k] = numbered_code(shot, k);
}

/// All pixels are those of this trigger and exposure.
inline bool shows(std::span<const std::uint16_t> codes, std::uint32_t counter,
                  std::chrono::nanoseconds exposure) {
  Shot shot;
  shot.counter = counter;
  shot.exposure = exposure;
  for (std::size_t k = 0; k < codes.size(); ++k)
    if (codes[k] != numbered_code(shot, k)) return false;
  return !codes.empty();
}

}  // namespace symrig::gige
