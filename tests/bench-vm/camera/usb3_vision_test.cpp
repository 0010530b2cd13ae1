// SPDX-License-Identifier: Apache-2.0
// A USB3 Vision camera on a real kernel: emulated, behind USB/IP, met by libusb, Aravis and our driver.
#include "assert_ok.hpp"
#include "gige/gige_camera.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"
#include "u3v/u3v_camera.hpp"
#include "usbip/usbip_server.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace symrig::bench_vm::usb3_vision_test {
namespace {

using namespace std::chrono_literals;
using camera::GenicamCamera;
using camera::GenicamSettings;
using gige::CameraTraits;
using gige::Mishap;

constexpr const char* kSerial = "U30017";
constexpr Nanoseconds kPatience = 5s;

/// Plugs the served device in, and waits until Aravis sees it.
bool plug_in() {
  for (const char* const command : {"ip link set lo up", "usbip attach -r 127.0.0.1 -b 1-1"})
    if (std::system(command) != 0) return false;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  for (int tries = 0; tries < 300 && camera::find_genicam_cameras().empty(); ++tries)
    std::this_thread::sleep_for(100ms);
  return camera::find_genicam_cameras().size() == 1;
}

/// A camera that plug_in() connects to the kernel.
class Served {
 public:
  explicit Served(CameraTraits traits = {}) : camera_(make_camera(std::move(traits))), server_(camera_) {}

  void unplug() { server_.unplug(); }

  bool pulse(Nanoseconds width, Mishap mishap = Mishap::none) {
    bool exposed = false;
    {
      const std::scoped_lock lock(server_.mutex());
      exposed = camera_->pulse(width, mishap);
    }
    server_.answer();
    return exposed;
  }
  std::uint32_t reg(std::uint32_t at) {
    const std::scoped_lock lock(server_.mutex());
    return camera_->reg(at);
  }

 private:
  static std::shared_ptr<u3v::U3vCamera> make_camera(CameraTraits traits) {
    return std::make_shared<u3v::U3vCamera>(std::move(traits), gige::numbered_scene, kSerial);
  }

  std::shared_ptr<u3v::U3vCamera> camera_;
  test::UsbIpServer server_;
};

GenicamSettings settings_for(const char* format) {
  GenicamSettings settings;
  settings.device = kSerial;
  settings.format = format;
  return settings;
}

/// What a command says, with its exit code at the end.
std::string said_by(const std::string& command) {
  const std::string all = "{ " + command + "; } 2>&1; echo exit $?";
  std::FILE* const said = popen(all.c_str(), "r");  // NOLINT(cert-env33-c)
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(said, pclose);
  std::string text;
  std::array<char, 4096> part{};
  while (pipe && std::fgets(part.data(), part.size(), pipe.get()) != nullptr) text += part.data();
  return text;
}

bool has_thread(const std::string& name) {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string found;
    std::ifstream(task.path() / "comm") >> found;
    if (found == name) return true;
  }
  return false;
}

SteadyTime now() {
  return SteadyTime{std::chrono::steady_clock::now().time_since_epoch()};
}

/// Takes one frame, which must be of this trigger. Returns its stamp.
SteadyTime expect_frame(GenicamCamera& camera, std::uint32_t counter, Nanoseconds exposure,
                        std::uint64_t sequence) {
  const auto frames = camera.take(1, kPatience);
  EXPECT_TRUE(frames.ok());
  if (!frames || frames->size() != 1) {
    ADD_FAILURE() << "no frame " << counter << ": " << camera.report().to_string();
    return {};
  }
  const CameraFrame& frame = frames->front();
  EXPECT_FALSE(frame.damaged);
  EXPECT_EQ(frame.sequence, sequence);
  EXPECT_TRUE(gige::shows(frame.raw, counter, exposure)) << "frame " << counter << " shows " << frame.raw[0];
  return frame.stamp;
}

TEST(Usb3Vision, a_camera_is_listed_and_described) {
  ASSERT_EQ(said_by("cp \"$SYMRIG_RULES\" /etc/udev/rules.d && udevadm control --reload"), "exit 0\n");
  Served served;
  ASSERT_TRUE(plug_in());
  const auto found = camera::find_genicam_cameras();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].driver, "USB3Vision");
  EXPECT_EQ(found[0].name, "Symrig Loopback");
  EXPECT_EQ(found[0].serial, kSerial);
  const std::string tagged = said_by(
      "udevadm settle; udevadm trigger --dry-run --verbose --subsystem-match=usb --tag-match=uaccess");
  EXPECT_NE(tagged.find("/vhci_hcd"), std::string::npos)
      << "the person at the machine may use it: " << tagged;
  const std::string list = said_by("\"$SYMRIG\" list");
  EXPECT_NE(list.find(found[0].path), std::string::npos) << list;
  EXPECT_NE(list.find("USB3Vision"), std::string::npos) << list;
  EXPECT_NE(list.find(kSerial), std::string::npos) << list;
  EXPECT_NE(list.find("exit 0"), std::string::npos) << list;
  const std::string info = said_by("\"$SYMRIG\" info --camera " + found[0].path);
  for (const char* const word : {"Symrig Loopback", "Mono12p", "ExposureTime", "exit 0"})
    EXPECT_NE(info.find(word), std::string::npos) << word << " is not in:\n" << info;
}

TEST(Usb3Vision, settings_are_the_cameras_and_each_frame_is_of_its_trigger) {
  Served served;
  ASSERT_TRUE(plug_in());
  GenicamSettings settings = settings_for("Mono16");
  settings.region = {8, 16, {32, 24}, 1};
  settings.gain = 3;
  settings.stamp = StampOf::exposure_end;
  settings.black_level = 17;
  settings.features = {{"LineInverter", "true"}, {"TriggerDelay", "250"}};
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  GenicamCamera& camera = **opened;
  EXPECT_EQ(camera.grid(), (Grid{32, 24}));
  testing::internal::CaptureStderr();
  const auto second = GenicamCamera::open(settings);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "a library prints nothing";
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::device_refused) << "one program at a time";
  EXPECT_NE(second.error().line().find("another program controls it; end that program"), std::string::npos)
      << second.error().line();
  for (const auto& [at, value] : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{{0x10000, 24},
                                                                                                {0x10004, 32},
                                                                                                {0x10008, 16},
                                                                                                {0x1000C, 8},
                                                                                                {0x10038, 3},
                                                                                                {0x1003C, 17},
                                                                                                {0x10064, 1}})
    EXPECT_EQ(served.reg(at), value) << std::hex << at;
  EXPECT_EQ(camera.timing().readout, 4ms) << "SensorReadoutTime";
  EXPECT_EQ(camera.timing().trigger_delay, 250us) << "TriggerDelay";
  for (std::uint32_t k = 1; k <= 40; ++k) {
    if (k == 20) std::this_thread::sleep_for(2s);  // Aravis takes its read back, and asks again
    const Nanoseconds width = (100 + 13 * k) * 1us;
    const SteadyTime before = now();
    ASSERT_TRUE(served.pulse(width));
    const SteadyTime after = now();
    const SteadyTime stamp = expect_frame(camera, k, width, k);
    // The driver takes a reading of the camera's clock that took 200 us at most: half of it is the error.
    EXPECT_GE(stamp.since, (before - 100us).since);
    EXPECT_LE(stamp.since, (after + 100us).since);
  }
  // The camera counts this trigger and has no room for the frame.
  ASSERT_TRUE(served.pulse(1ms, Mishap::frame_dropped));
  ASSERT_TRUE(served.pulse(2ms));
  expect_frame(camera, 42, 2ms, 42);
  const StreamReport report = camera.report();
  EXPECT_EQ(report.delivered, 41U);
  EXPECT_EQ(report.missing, 1U);
  EXPECT_EQ(report.damaged + report.overflowed + report.repeated + report.reordered, 0U)
      << report.to_string();
}

TEST(Usb3Vision, frames_without_chunks_are_counted_by_their_ids) {
  CameraTraits traits;
  traits.has_chunks = false;
  Served served(traits);
  ASSERT_TRUE(plug_in());
  auto opened = GenicamCamera::open(settings_for("Mono16"));
  ASSERT_OK(opened);
  GenicamCamera& camera = **opened;
  for (std::uint32_t k = 1; k <= 20; ++k) {
    ASSERT_TRUE(served.pulse(k * 1ms, k == 7 || k == 8 ? Mishap::frame_dropped : Mishap::none));
    if (k != 7 && k != 8) expect_frame(camera, k, k * 1ms, k - 1);
  }
  EXPECT_EQ(camera.report().delivered, 18U);
  EXPECT_EQ(camera.report().missing, 2U);
}

TEST(Usb3Vision, a_frame_of_several_transfers_is_whole) {
  CameraTraits traits;
  traits.rows = 768;
  traits.cols = 1024;  // 1.5 MiB; Aravis reads 1 MiB at once
  Served served(traits);
  ASSERT_TRUE(plug_in());
  auto opened = GenicamCamera::open(settings_for("Mono16"));
  ASSERT_OK(opened);
  for (std::uint32_t k = 1; k <= 4; ++k) {
    ASSERT_TRUE(served.pulse(1ms));
    expect_frame(**opened, k, 1ms, k);
  }
  EXPECT_EQ((*opened)->report().delivered, 4U);
  EXPECT_EQ((*opened)->report().damaged, 0U);
}

TEST(Usb3Vision, an_unplugged_camera_is_lost_and_opens_again) {
  Served served;
  ASSERT_TRUE(plug_in());
  for (int time = 0; time < 2; ++time) {
    auto opened = GenicamCamera::open(settings_for("Mono12p"));
    ASSERT_OK(opened);
    ASSERT_TRUE(served.pulse(3ms));
    ASSERT_TRUE((*opened)->take(1, kPatience).ok());
    EXPECT_TRUE(has_thread("arv_uv_stream"));
    served.unplug();
    const auto lost = (*opened)->take(1, kPatience);
    ASSERT_FALSE(lost);
    EXPECT_EQ(lost.error().code, ErrorCode::device_lost) << lost.error().line();
    EXPECT_NE(lost.error().line().find("does not answer any more"), std::string::npos) << lost.error().line();
    // Aravis would ask a camera that is gone for as long as its stream is open, as fast as it can.
    while (has_thread("arv_uv_stream")) std::this_thread::sleep_for(10ms);
    EXPECT_EQ((*opened)->report().delivered, 1U);
    opened->reset();
    ASSERT_TRUE(plug_in());
  }
}

}  // namespace
}  // namespace symrig::bench_vm::usb3_vision_test
