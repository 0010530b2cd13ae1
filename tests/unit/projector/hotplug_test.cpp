// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/hotplug.hpp"

#include <string>

#include <gtest/gtest.h>

namespace symrig::projector::drm::test::hotplug_test {
namespace {

using namespace std::string_literals;

const std::string kPlug =
    "change@/devices/pci0000:00/0000:00:02.0/drm/card1\0ACTION=change\0SUBSYSTEM=drm\0HOTPLUG=1\0"
    "MAJOR=226\0MINOR=1\0DEVNAME=dri/card1\0DEVTYPE=drm_minor\0SEQNUM=2604\0"s;

std::string plug_with(const std::string& lines) {
  std::string text = kPlug;
  return text.append(lines);
}

TEST(Hotplug, a_plug_at_our_card_is_heard) {
  EXPECT_TRUE(is_hotplug_message(kPlug, "card1", 21));
  EXPECT_TRUE(is_hotplug_message(plug_with("CONNECTOR=21\0"s), "card1", 21));
}

TEST(Hotplug, what_is_not_ours_is_not) {
  EXPECT_FALSE(is_hotplug_message(kPlug, "card0", 21));
  EXPECT_FALSE(is_hotplug_message(kPlug, "card11", 21));
  EXPECT_FALSE(is_hotplug_message(plug_with("CONNECTOR=210\0"s), "card1", 21));
  EXPECT_FALSE(is_hotplug_message(plug_with("CONNECTOR=21\0PROPERTY=44\0"s), "card1", 21))
      << "content protection";
}

TEST(Hotplug, other_messages_are_passed_over) {
  EXPECT_FALSE(is_hotplug_message("", "card1", 21));
  EXPECT_FALSE(is_hotplug_message("add@/x\0ACTION=add\0SUBSYSTEM=drm\0DEVNAME=dri/card1"s, "card1", 21));
  EXPECT_FALSE(is_hotplug_message("change@/x\0SUBSYSTEM=usb\0HOTPLUG=1\0DEVNAME=dri/card1\0"s, "card1", 21));
}

}  // namespace
}  // namespace symrig::projector::drm::test::hotplug_test
