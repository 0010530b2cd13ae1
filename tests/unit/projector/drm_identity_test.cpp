// SPDX-License-Identifier: Apache-2.0
// What stands between memory and wire is set to identity and read back, or told.
#include "assert_ok.hpp"
#include "drm_bench.hpp"
#include "projector/drm/identity.hpp"

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
