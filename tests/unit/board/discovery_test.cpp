// SPDX-License-Identifier: Apache-2.0

#include "bench.hpp"
#include "scratch.hpp"
#include "symrig/board/link.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::device_uri_test {
namespace {

TEST(DeviceUri, every_form_comes_back_as_it_was_written) {
  for (const std::string text :
       {"sim:", "sim:?jumper=lamp_enable:vsync", "usb:", "usb:E66038B713", "serial:/dev/ttyACM0",
        "serial:/dev/ttyUSB0?baud=921600", "tcp:bench.local:4000", "tcp:[::1]:4000", "unix:/run/board",
        "unix:board", "virtual:tcp:127.0.0.1:3241", "virtual:unix:/tmp/a:b", "virtual:unix:v?jumper=5:17",
        "virtual:tcp:[::1]:9?jumper=0:28"}) {
    const auto uri = DeviceUri::parse(text);
    ASSERT_TRUE(uri.ok()) << uri.error().line();
    EXPECT_EQ(uri->text(), text);
    EXPECT_EQ(*DeviceUri::parse(uri->text()), *uri);
  }
}

TEST(DeviceUri, parts) {
  const auto tcp = DeviceUri::parse("tcp:[fe80::1]:65535");
  ASSERT_TRUE(tcp.ok());
  EXPECT_EQ(tcp->transport, Transport::tcp);
  EXPECT_EQ(tcp->place, "fe80::1");
  EXPECT_EQ(tcp->port, 65'535);
  const auto serial = DeviceUri::parse("serial:/dev/ttyS3?baud=9600");
  ASSERT_TRUE(serial.ok());
  EXPECT_EQ(serial->place, "/dev/ttyS3");
  EXPECT_EQ(serial->baud, 9600U);
  const auto sim = DeviceUri::parse("sim:?jumper=a:b");
  ASSERT_TRUE(sim.ok());
  EXPECT_EQ(sim->jumper_from, "a");
  EXPECT_EQ(sim->jumper_to, "b");
}

TEST(DeviceUri, what_is_wrong_is_named) {
  struct Case {
    const char* text;
    const char* why;
  };
  for (const Case& one : {Case{"", "known kind of link"},
                          Case{"usb", "known kind of link"},
                          Case{"ftp:x", "known kind of link"},
                          Case{"SIM:", "known kind of link"},
                          Case{"serial:", "path of the serial port"},
                          Case{"serial:/dev/x?baud=fast", "'fast' is not a baud rate"},
                          Case{"serial:/dev/x?baud=0", "'0' is not a baud rate"},
                          Case{"serial:/dev/x?speed=9", "only option of serial:"},
                          Case{"tcp:host", "port is missing"},
                          Case{"tcp:host:", "'' is not a port"},
                          Case{"tcp:host:0", "'0' is not a port"},
                          Case{"tcp:host:65536", "'65536' is not a port"},
                          Case{"tcp:host:12x", "'12x' is not a port"},
                          Case{"tcp::4000", "host is missing"},
                          Case{"tcp:::1:4000", "brackets"},
                          Case{"unix:", "path of the socket"},
                          Case{"virtual:", "known kind of link"},
                          Case{"virtual:unix:", "path of the socket"},
                          Case{"virtual:tcp:h", "port is missing"},
                          Case{"virtual:unix:v?jumper=aux0:vsync", "two pin numbers"},
                          Case{"virtual:unix:v?jumper=3:300", "two pin numbers"},
                          Case{"virtual:unix:v?x=3:3", "its only option"},
                          Case{"sim:x", "no text is allowed"},
                          Case{"sim:?jumper=a", "jumper must be OUT:IN"},
                          Case{"sim:?jumper=:b", "jumper must be OUT:IN"},
                          Case{"sim:?drift=3", "its only option"}}) {
    const auto uri = DeviceUri::parse(one.text);
    ASSERT_FALSE(uri.ok()) << one.text;
    EXPECT_EQ(uri.error().code, ErrorCode::bad_argument);
    EXPECT_NE(uri.error().what.find(one.why), std::string::npos) << uri.error().line();
  }
}

}  // namespace
}  // namespace symrig::device_uri_test

namespace symrig::discovery_test {
namespace {

using symrig::test::Scratch;

class FakeBus final : public UsbBus {
 public:
  explicit FakeBus(std::vector<UsbDevice> devices) : devices_(std::move(devices)) {}
  Result<std::vector<UsbDevice>> devices() override { return devices_; }

 private:
  std::vector<UsbDevice> devices_;
};

UsbDevice board(const std::string& serial, const std::string& port) {
  return {0x1209, 0x0001, "symrig", "symrig trigger board", serial, port, true};
}

std::vector<FoundBoard> find(std::vector<UsbDevice> devices,
                             const std::filesystem::path& ports = "/nonexistent") {
  FakeBus bus(std::move(devices));
  auto found = find_boards(bus, ports);
  EXPECT_TRUE(found.ok());
  return std::move(found).value();
}

TEST(Discovery, only_ours_are_boards) {
  UsbDevice stranger = board("5", "1-5");
  stranger.maker = "Somebody";
  stranger.product = "Not symrig";
  UsbDevice other_vendor = board("6", "1-6");
  other_vendor.vendor = 0x2E8A;
  UsbDevice by_product = board("7", "1-7");
  by_product.maker = "Somebody";
  const auto found = find({board("E6", "1-2"), stranger, other_vendor, by_product, board("D4", "2-1.3")});
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].uri.text(), "usb:7");
  EXPECT_EQ(found[1].uri.text(), "usb:D4");
  EXPECT_EQ(found[1].port, "2-1.3");
  EXPECT_EQ(found[2].uri.text(), "usb:E6");
}

TEST(Discovery, serial_ports_of_boards_that_usb_does_not_show) {
  const Scratch scratch;
  std::ofstream(scratch / "port") << "";
  for (const char* name : {"usb-symrig_trigger_board_ABC123-if00", "usb-symrig_trigger_board_E6-if02",
                           "usb-FTDI_Cable_99-if00-port0"})
    std::filesystem::create_symlink(scratch / "port", scratch / name);
  const auto found = find({board("E6", "1-2")}, scratch.folder());
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].uri.text(), "usb:E6");
  EXPECT_EQ(found[1].uri.transport, Transport::serial);
  EXPECT_EQ(found[1].uri.place, (scratch / "usb-symrig_trigger_board_ABC123-if00").string());
  EXPECT_EQ(found[1].serial, "ABC123");
  EXPECT_EQ(found[1].product, "symrig trigger board");
}

TEST(Discovery, serial_ports_of_others_are_named_and_not_boards) {
  const Scratch scratch;
  std::ofstream(scratch / "port") << "";
  const Scratch ports;
  for (const char* name : {"usb-symrig_trigger_board_E6-if02", "usb-FTDI_Cable_99-if00-port0",
                           "usb-Arduino__www.arduino.cc__0042_7583-if00"})
    std::filesystem::create_symlink(scratch / "port", ports / name);
  const auto others = other_serial_ports(ports.folder());
  ASSERT_EQ(others.size(), 2U);
  EXPECT_EQ(others[0].text(), "serial:" + (ports / "usb-Arduino__www.arduino.cc__0042_7583-if00").string());
  EXPECT_EQ(others[1].place, (ports / "usb-FTDI_Cable_99-if00-port0").string());
  EXPECT_TRUE(other_serial_ports("/nonexistent").empty());
}

TEST(Discovery, the_only_board_is_taken_unnamed) {
  const auto uri = choose_board(find({board("E6", "1-2")}), "");
  ASSERT_OK(uri);
  EXPECT_EQ(uri->text(), "usb:E6");
}

TEST(Discovery, of_several_none_is_guessed) {
  const auto found = find({board("E6603", "1-2"), board("E6614", "1-3"), board("D4", "1-4")});
  const auto unnamed = choose_board(found, "");
  ASSERT_FALSE(unnamed.ok());
  EXPECT_EQ(exit_code(unnamed.error().code), 2);
  EXPECT_EQ(unnamed.error().line(),
            "3 boards are connected; name one of them: usb:D4 (1-4), usb:E6603 (1-2), usb:E6614 (1-3)");
  const auto ambiguous = choose_board(found, "e66");
  ASSERT_FALSE(ambiguous.ok());
  EXPECT_EQ(ambiguous.error().line(),
            "'e66' matches 2 boards; name one of them: usb:E6603 (1-2), usb:E6614 (1-3)");
  const auto chosen = choose_board(found, "e661");
  ASSERT_OK(chosen);
  EXPECT_EQ(chosen->text(), "usb:E6614");
}

TEST(Discovery, no_board_and_no_such_board) {
  const auto none = choose_board(std::vector<FoundBoard>{}, "");
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(exit_code(none.error().code), 3);
  const auto unknown = choose_board(find({board("E6", "1-2")}), "F");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::unknown_name);
  EXPECT_NE(unknown.error().hint.find("usb:E6"), std::string::npos);
}

TEST(Discovery, a_uri_needs_no_looking) {
  const auto uri = choose_board("tcp:localhost:4000");
  ASSERT_OK(uri);
  EXPECT_EQ(uri->transport, Transport::tcp);
  EXPECT_FALSE(choose_board("nonsense:4").ok());
}

TEST(Discovery, the_environment_names_a_board_when_nobody_else_does) {
  ASSERT_EQ(setenv("SYMRIG_DEVICE", "sim:", 1), 0);
  const auto from_environment = choose_board("");
  const auto named = choose_board("unix:/x");
  ASSERT_EQ(unsetenv("SYMRIG_DEVICE"), 0);
  ASSERT_OK(from_environment);
  EXPECT_EQ(from_environment->text(), "sim:");
  ASSERT_OK(named);
  EXPECT_EQ(named->text(), "unix:/x");
}

TEST(SimDevice, comes_with_projector_and_camera_or_a_jumper) {
  auto plain = open_link(*DeviceUri::parse("sim:"));
  ASSERT_OK(plain);
  Board board = test::Bench::connect(std::move(plain).value());
  ASSERT_OK(board.configure({}));
  const auto program =
      ProgramBuilder(board.info())
          .pulse("projector_trigger", std::chrono::microseconds(100))
          .wait_edge("vsync", EdgeKind::rising, std::chrono::milliseconds(50), OnTimeout::abort)
          .hold(std::chrono::milliseconds(1))
          .end();
  ASSERT_OK(program);
  const auto receipt = board.run(*program, std::chrono::seconds(1));
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());

  EXPECT_TRUE(open_link(*DeviceUri::parse("sim:?jumper=lamp_enable:vsync")).ok());
  const auto wrong = open_link(*DeviceUri::parse("sim:?jumper=vsync:lamp_enable"));
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::unknown_name);
  EXPECT_NE(wrong.error().hint.find("lamp_enable"), std::string::npos);
}

}  // namespace
}  // namespace symrig::discovery_test
