// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/device_uri.hpp"

#include <string>

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
