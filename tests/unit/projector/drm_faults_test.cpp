// SPDX-License-Identifier: Apache-2.0
// What can go wrong at a screen, each by itself: the error names the connector and the cause, and nothing is
// left behind.
#include "assert_ok.hpp"
#include "fake_kms.hpp"

#include <cerrno>

namespace symrig::projector::drm::test::drm_faults_test {
namespace {

class Faults : public DrmBench, public ::testing::WithParamInterface<bool> {
 protected:
  Faults() {
    options.legacy = !GetParam();
    options.patience = Nanoseconds(200'000'000);
  }
  ~Faults() override {
    projector.reset();
    EXPECT_EQ(card->live_buffers, 0);
    EXPECT_EQ(card->open_files, 0);
    if (!card->gone) {
      EXPECT_TRUE(card->blobs.empty());
    }
  }
  /// The next show() and every one after it must fail so.
  void expect_lost(ErrorCode code, const std::string& cause) {
    for (int attempt = 0; attempt < 2; ++attempt) {
      const auto shown = projector->show(1);
      ASSERT_FALSE(shown.ok());
      EXPECT_EQ(shown.error().code, code) << shown.error().line();
      EXPECT_NE(shown.error().what.find("card0-HDMI-A-1"), std::string::npos) << shown.error().line();
      EXPECT_NE(shown.error().what.find(cause), std::string::npos) << shown.error().line();
      EXPECT_FALSE(shown.error().hint.empty());
    }
  }
  void start() {
    projector = opened();
    ASSERT_TRUE(projector);
    ASSERT_OK(projector->show(0));
  }
  /// From the next flip on.
  void at_next_flip(const std::function<Errno()>& fault) {
    const std::uint64_t next = card->flips + 1;
    card->on_flip = [=](std::uint64_t flip) { return flip >= next ? fault() : 0; };
  }
  /// Everything is well again: a new projector works.
  void expect_reopens() {
    projector.reset();
    card->on_flip = {};
    card->on_event = {};
    card->lose_event = {};
    card->gone = false;
    start();
  }

  std::unique_ptr<DrmProjector> projector;
};

TEST_P(Faults, unplugged_between_two_patterns) {
  start();
  card->connectors[21].connected = false;
  expect_lost(ErrorCode::device_lost, "unplugged");
  card->connectors[21].connected = true;
  expect_lost(ErrorCode::device_lost, "unplugged");
  expect_reopens();
}

TEST_P(Faults, unplugged_in_mid_flip) {
  start();
  at_next_flip([&] {
    card->connectors[21].connected = false;  // the CRTC goes on all the same
    return 0;
  });
  expect_lost(ErrorCode::device_lost, "unplugged");
}

TEST_P(Faults, unplugged_and_plugged_in_again) {
  start();
  card->hotplug = true;
  expect_lost(ErrorCode::device_lost, "plugged in or out");
  expect_reopens();
}

TEST_P(Faults, the_card_is_removed_in_mid_flip) {
  start();
  at_next_flip([&] {
    card->gone = true;
    return ENODEV;
  });
  expect_lost(ErrorCode::device_lost, "is lost");
  expect_reopens();
}

TEST_P(Faults, the_card_is_removed_while_a_refresh_is_waited_for) {
  start();
  at_next_flip([&] {
    card->gone = true;
    return 0;
  });
  expect_lost(ErrorCode::device_lost, "is lost");
}

TEST_P(Faults, another_program_becomes_master) {
  start();
  at_next_flip([] { return EACCES; });
  expect_lost(ErrorCode::device_lost, "another program");
  expect_reopens();
}

TEST_P(Faults, a_busy_driver_is_asked_again) {
  start();
  const std::uint64_t until = card->flips + 5;
  card->on_flip = [=](std::uint64_t flip) { return flip < until ? EBUSY : 0; };
  ASSERT_OK(projector->show(1));
  EXPECT_EQ(card->scanned_out(), wanted(*projector, 1));
}

TEST_P(Faults, a_driver_that_stays_busy_is_given_up) {
  start();
  at_next_flip([] { return EBUSY; });
  expect_lost(ErrorCode::timeout, "not accepted");
  expect_reopens();
}

TEST_P(Faults, an_event_is_lost) {
  start();
  const std::uint64_t next = card->flips + 1;
  card->lose_event = [=](std::uint64_t flip) { return flip >= next; };
  const auto before = card->time;
  expect_lost(ErrorCode::timeout, "no refresh came within 0.2 s");
  EXPECT_EQ(card->time - before, options.patience) << "the second answer needs no waiting";
  expect_reopens();
}

TEST_P(Faults, events_of_other_flips_are_passed_over) {
  start();
  card->on_event = [](std::uint64_t, FlipEvent& event) { event.token += 1000; };
  expect_lost(ErrorCode::timeout, "no refresh came");
}

TEST_P(Faults, the_count_of_refreshes_goes_back) {
  start();
  card->on_event = [](std::uint64_t, FlipEvent& event) { event.sequence = 5; };
  expect_lost(ErrorCode::device_lost, "its refresh count went from");
  expect_reopens();
}

TEST_P(Faults, two_flips_cannot_have_one_refresh) {
  start();
  const auto shown = projector->show(0);
  ASSERT_OK(shown);
  card->on_event = [&](std::uint64_t, FlipEvent& event) {
    event.sequence = static_cast<std::uint32_t>(shown->refresh);
  };
  expect_lost(ErrorCode::device_lost, "its refresh count went from");
}

TEST_P(Faults, the_link_breaks_down) {
  card->add_property(21, {.name = "link-status", .value = DRM_MODE_LINK_STATUS_GOOD});
  start();
  card->property(21, "link-status").value = DRM_MODE_LINK_STATUS_BAD;
  expect_lost(ErrorCode::device_lost, "link");
}

TEST_P(Faults, video_memory_runs_out_at_a_flip) {
  start();
  at_next_flip([] { return ENOMEM; });
  expect_lost(ErrorCode::limit, "not accepted");
}

TEST_P(Faults, a_failed_start_leaves_nothing) {
  card->on_flip = [](std::uint64_t flip) { return flip == 3 ? EINVAL : 0; };
  const auto refused = open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_refused);
  card->on_flip = {};
  card->memory = 1;
  EXPECT_EQ(open().error().code, ErrorCode::limit);
}

TEST_P(Faults, a_desktop_holds_the_card) {
  card->stuck_master = 1'000;
  cards.held_by = {"Xorg (1234)"};
  const auto refused = open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_refused);
  EXPECT_EQ(refused.error().line(),
            "card0 is in use by Xorg (1234); end that program first; for a desktop: sudo systemctl stop "
            "display-manager");
}

TEST_P(Faults, somebody_who_only_looks_is_waited_for) {
  card->stuck_master = 3;
  start();
}

INSTANTIATE_TEST_SUITE_P(Both, Faults, ::testing::Bool(),
                         [](const auto& atomic) { return std::string(atomic.param ? "atomic" : "legacy"); });

}  // namespace
}  // namespace symrig::projector::drm::test::drm_faults_test
