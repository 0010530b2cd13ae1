// SPDX-License-Identifier: Apache-2.0

#include "assert_ok.hpp"
#include "fake_kms.hpp"
#include "symrig/projector/internal/drm.hpp"

#include <drm_fourcc.h>
#include <gtest/gtest.h>

namespace symrig::projector::drm::test::drm_route_test {
namespace {

std::shared_ptr<FakeCard> a_card() {
  return std::make_shared<FakeCard>(FakeCard::with_one_display());
}

/// The connector that is found by a name, or the error's code.
std::string find(Cards& cards, const std::string& wanted) {
  const auto found = find_connector(cards, wanted);
  return found ? found->card + "-" + found->connector.name : std::string(name(found.error().code));
}

TEST(FindConnector, by_full_name_by_short_name_and_by_being_the_only_one) {
  const auto first = a_card(), second = a_card();
  second->connectors[21].name = "DP-1";
  second->connectors[21].connected = false;
  FakeCards cards({first, second});
  EXPECT_EQ(find(cards, ""), "card0-HDMI-A-1");
  EXPECT_EQ(find(cards, "HDMI-A-1"), "card0-HDMI-A-1");
  EXPECT_EQ(find(cards, "card0-HDMI-A-1"), "card0-HDMI-A-1");
  EXPECT_EQ(find(cards, "card1-HDMI-A-1"), "unknown_name");
  EXPECT_EQ(find(cards, "card1-DP-1"), "device_lost") << "nothing is plugged in there";
  second->connectors[21].connected = true;
  EXPECT_EQ(find(cards, "DP-1"), "card1-DP-1");
  EXPECT_EQ(find(cards, ""), "bad_argument") << "two are plugged in";
  second->connectors[21].name = "HDMI-A-1";
  EXPECT_EQ(find(cards, "HDMI-A-1"), "bad_argument");
  EXPECT_EQ(find(cards, "card1-HDMI-A-1"), "card1-HDMI-A-1");
  EXPECT_EQ(first->open_files + second->open_files, 0);
}

TEST(FindConnector, says_what_there_is) {
  const auto card = a_card();
  card->connectors[22] = {22, "DP-1", false, {}, 1, 0};
  FakeCards cards(card);
  EXPECT_EQ(find_connector(cards, "VGA-1").error().line(),
            "there is no connector 'VGA-1'; this computer has card0-HDMI-A-1, card0-DP-1");
  EXPECT_EQ(find_connector(cards, "DP-1").error().line(),
            "nothing is connected to card0-DP-1; a display is connected to card0-HDMI-A-1");
  card->connectors[21].connected = false;
  EXPECT_EQ(find_connector(cards, "").error().line(),
            "no projector is connected; connect one to card0-HDMI-A-1, card0-DP-1");
  FakeCards none(std::vector<std::shared_ptr<FakeCard>>{});
  EXPECT_EQ(find_connector(none, "").error().code, ErrorCode::device_lost);
}

TEST(FindConnector, a_card_without_permission_is_told_only_if_it_is_in_the_way) {
  FakeCards cards({a_card(), a_card()});
  cards.unopenable.emplace("card0", Error{ErrorCode::device_lost, "card0: no permission"});
  EXPECT_EQ(find(cards, ""), "card1-HDMI-A-1");
  EXPECT_EQ(find_connector(cards, "card0-HDMI-A-1").error().what, "card0: no permission");
}

/// Two CRTCs, two connectors that can have either.
class TwoHeads : public ::testing::Test {
 protected:
  TwoHeads() {
    card->crtcs[12] = Crtc{.id = 12};
    card->connectors[21].possible_crtcs = 3;
    card->connectors[22] = {22, "DP-1", true, {make_mode(64, 48, 60, true)}, 3, 0};
    card->planes[31].possible_crtcs = 3;
    card->planes[33] = {33, 3, 0, {DRM_FORMAT_XRGB8888}};
    card->add_property(33, {.name = "type", .value = DRM_PLANE_TYPE_PRIMARY});
  }
  Route route() {
    auto found = find_connector(cards, "HDMI-A-1");
    EXPECT_TRUE(found.ok());
    auto chosen = choose_route(*found->kms, *found, {});
    EXPECT_TRUE(chosen.ok()) << chosen.error().line();
    return *chosen;
  }
  std::shared_ptr<FakeCard> card = a_card();
  FakeCards cards{card};
};

TEST_F(TwoHeads, a_connector_keeps_its_crtc) {
  card->connectors[21].crtc = 12;
  card->planes[33].crtc = 12;
  EXPECT_EQ(route().crtc, 12U);
  EXPECT_EQ(route().plane, 33U);
}

TEST_F(TwoHeads, another_display_keeps_its_crtc_and_plane_too) {
  card->connectors[22].crtc = 11;
  card->planes[31].crtc = 11;
  const Route chosen = route();
  EXPECT_EQ(chosen.crtc, 12U);
  EXPECT_EQ(chosen.plane, 33U);
  EXPECT_TRUE(chosen.other_connectors.empty());
}

TEST_F(TwoHeads, a_display_that_shares_the_crtc_is_let_go) {
  card->connectors[21].crtc = 11;
  card->connectors[22].crtc = 11;  // a console on both
  EXPECT_EQ(route().other_connectors, std::vector<std::uint32_t>{22});
}

TEST_F(TwoHeads, no_crtc_is_an_error) {
  card->connectors[21].possible_crtcs = 0;
  auto found = find_connector(cards, "HDMI-A-1");
  ASSERT_OK(found);
  EXPECT_EQ(choose_route(*found->kms, *found, {}).error().code, ErrorCode::device_refused);
}

}  // namespace
}  // namespace symrig::projector::drm::test::drm_route_test

// What stands between memory and wire is set to identity and read back, or told.

namespace symrig::projector::drm::test::drm_identity_test {
namespace {

class Identity : public DrmBench, public ::testing::WithParamInterface<bool> {
 protected:
  Identity() {
    options.legacy = !GetParam();
    card->add_property(11, {.name = "GAMMA_LUT", .value = 900, .blob = true});
    card->add_property(11, {.name = "CTM", .value = 900, .blob = true});
    card->blobs[900] = {std::byte{1}};
    card->add_property(21, {.name = "Broadcast RGB",
                            .value = 0,
                            .choices = {{"Automatic", 0}, {"Full", 1}, {"Limited 16:235", 2}}});
    card->add_property(21, {.name = "max bpc", .value = 12, .range = {{6, 12}}});
    card->add_property(21, {.name = "DPMS", .value = 3, .choices = {{"On", 0}, {"Off", 3}}});
    card->add_property(31, {.name = "rotation", .value = 4, .choices = {{"rotate-0", 1}, {"rotate-180", 4}}});
    card->add_property(21, {.name = "scaling mode", .value = 1, .choices = {{"None", 0}, {"Full", 1}}});
  }
  Error refusal() {
    const auto projector = open();
    return projector ? Error{ErrorCode::fault, "it was opened"} : projector.error();
  }
};

TEST_P(Identity, everything_is_set) {
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_TRUE((*projector)->warnings().empty()) << (*projector)->warnings().at(0);
  EXPECT_EQ(card->property(11, "GAMMA_LUT").value, 0U);
  EXPECT_EQ(card->property(11, "CTM").value, 0U);
  EXPECT_EQ(card->property(21, "Broadcast RGB").value, 1U);
  EXPECT_EQ(card->property(21, "max bpc").value, 8U);
  EXPECT_EQ(card->property(31, "rotation").value, 1U);
  EXPECT_EQ(card->property(21, "scaling mode").value, 0U);
  if (!GetParam()) {
    EXPECT_EQ(card->property(21, "DPMS").value, 0U);
  }
}

TEST_P(Identity, what_changes_pixels_and_is_refused_is_an_error) {
  for (const char* name : {"GAMMA_LUT", "CTM", "rotation"}) {
    card->refused = {name};
    const Error error = refusal();
    EXPECT_EQ(error.code, ErrorCode::device_refused);
    EXPECT_NE(error.what.find(std::string("'") + name + "'"), std::string::npos) << error.line();
  }
}

TEST_P(Identity, what_is_accepted_and_not_done_is_found_out) {
  for (const char* name : {"GAMMA_LUT", "CTM", "rotation"}) {
    card->ignored = {name};
    EXPECT_EQ(refusal().code, ErrorCode::device_refused) << name;
  }
  card->ignored = {"max bpc"};
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_EQ((*projector)->warnings(),
            std::vector<std::string>{"connector property 'max bpc' is '12' and cannot be '8'"});
}

TEST_P(Identity, what_may_matter_is_a_warning_by_name) {
  card->refused = {"Broadcast RGB", "max bpc"};
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_EQ(
      (*projector)->warnings(),
      (std::vector<std::string>{"connector property 'Broadcast RGB' is 'Automatic' and cannot be 'Full'",
                                "connector property 'max bpc' is '12' and cannot be '8'"}));
  EXPECT_EQ(card->property(21, "scaling mode").value, 0U) << "what can be set is set all the same";
}

TEST_P(Identity, a_missing_choice_or_range_is_told) {
  card->property(21, "Broadcast RGB").choices = {{"Automatic", 0}};
  card->property(21, "max bpc").range = {{10, 12}};
  card->property(21, "scaling mode").immutable = true;
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_EQ((*projector)->warnings().size(), 3U);
  card->property(31, "rotation").choices = {{"rotate-180", 4}};
  EXPECT_EQ(refusal().code, ErrorCode::device_refused);
}

TEST_P(Identity, an_old_gamma_table_is_straightened_and_put_back) {
  card->properties[11].erase(card->properties[11].begin() + 2,
                             card->properties[11].end());  // no GAMMA_LUT, no CTM
  card->crtcs[11].gamma_size = 256;
  Gamma bent = straight_gamma(256);
  bent.green[100] = 1;
  card->gammas[11] = bent;
  {
    const auto projector = open();
    ASSERT_OK(projector);
    EXPECT_TRUE((*projector)->warnings().empty());
    EXPECT_EQ(card->gammas[11], straight_gamma(256));
  }
  EXPECT_EQ(card->gammas[11], bent);
  card->refused = {"gamma"};
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_EQ((*projector)->warnings().size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Both, Identity, ::testing::Bool(),
                         [](const auto& atomic) { return std::string(atomic.param ? "atomic" : "legacy"); });

TEST(StraightGamma, goes_from_0_to_all_ones_in_equal_steps) {
  const Gamma gamma = straight_gamma(256);
  for (std::size_t i = 0; i < 256; ++i) EXPECT_EQ(gamma.red[i], 257 * i);
  EXPECT_EQ(gamma.red, gamma.blue);
  const Gamma odd = straight_gamma(1000);
  EXPECT_EQ(odd.green.front(), 0);
  EXPECT_EQ(odd.green.back(), 65'535);
  EXPECT_TRUE(straight_gamma(0).red.empty());
}

}  // namespace
}  // namespace symrig::projector::drm::test::drm_identity_test
