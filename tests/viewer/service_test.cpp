// SPDX-License-Identifier: Apache-2.0
// What the server answers, without a network; and what pages contain.
#include "viewer/service.hpp"

#include "assert_ok.hpp"
#include "symrig/viewer/page.hpp"
#include "viewer/pack.hpp"
#include "viewer/view_service.hpp"

#include <cstring>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace symrig::service_test {
namespace {

StoredScene small_scene() {
  const Grid grid{4, 4};
  TensorBuilder builder(BlockTree(grid), 1);
  for (std::int32_t i = 0; i < 16; ++i) builder.add_scalar(i, i, std::vector<float>{0.5F});
  StoredScene scene;
  scene.tensor = std::move(builder).finish();
  scene.held_out.push_back({"</script><script>alert(1)</script>", Image<float>(grid), Image<float>(grid)});
  return scene;
}

viewer::ViewService service() {
  return {small_scene(), {.title = "a \"title\" </script>", .truth = {}}, "secret", "nonce"};
}

template <class T>
void put(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// One run of four pixels from pixel 2, each `half`.
std::string light_bytes(std::uint16_t half) {
  std::string bytes;
  for (const std::uint32_t word : {1U, 1U, 2U, 4U}) put(bytes, word);
  for (int k = 0; k < 4; ++k) put(bytes, half);
  return bytes;
}

constexpr std::uint16_t kOne = 0x3C00, kInfinity = 0x7C00;

TEST(LightCode, reads_runs) {
  const auto light = viewer::decode_light(light_bytes(kOne), {4, 4});
  ASSERT_TRUE(light.has_value());
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ((*light)[0].values()[i], i >= 2 && i < 6 ? 1.0F : 0.0F);
}

TEST(LightCode, refuses_anything_else) {
  EXPECT_FALSE(viewer::decode_light(light_bytes(kInfinity), {4, 4}));
  EXPECT_FALSE(viewer::decode_light(light_bytes(kOne), {1, 5}));
  EXPECT_FALSE(viewer::decode_light(light_bytes(kOne) + "x", {4, 4}));
  for (std::size_t cut = 0; cut < light_bytes(kOne).size(); ++cut)
    EXPECT_FALSE(viewer::decode_light(light_bytes(kOne).substr(0, cut), {4, 4})) << cut;
  std::mt19937 rng(1);
  for (int k = 0; k < 20'000; ++k) {
    std::string bytes = light_bytes(kOne);
    for (int changes = 0; changes < 3; ++changes) bytes[rng() % bytes.size()] = static_cast<char>(rng());
    const auto light = viewer::decode_light(bytes, {4, 4});
    EXPECT_TRUE(!light || light->size() == 1 || light->size() == 3);
  }
}

TEST(ViewService, relights) {
  const auto reply = service().answer(
      {.method = "POST", .target = "/secret/relight?x", .host = "localhost:1", .body = light_bytes(kOne)});
  ASSERT_EQ(reply.status, 200U);
  ASSERT_EQ(reply.body.size(), 4U + 2 * 16);
  std::int32_t exponent = 0;
  std::uint16_t halves[16];
  std::memcpy(&exponent, reply.body.data(), 4);
  std::memcpy(halves, reply.body.data() + 4, sizeof(halves));
  EXPECT_EQ(halves[0], 0);
  EXPECT_EQ(halves[2], 0x5800);  // 2^7
  EXPECT_EQ(exponent, -8);       // 2^7 · 2^-8 = 0.5
}

TEST(ViewService, refuses_requests_from_elsewhere) {
  const auto status = [](std::string_view target, std::string_view host, std::string_view origin = "") {
    return service().answer({.method = "GET", .target = target, .host = host, .origin = origin}).status;
  };
  EXPECT_EQ(status("/secret/", "127.0.0.1:8080"), 200U);
  EXPECT_EQ(status("/secret/", "[::1]"), 200U);
  EXPECT_EQ(status("/secret/", "localhost", "http://localhost:5"), 200U);
  EXPECT_EQ(status("/secret/", "evil.example"), 403U);
  EXPECT_EQ(status("/secret/", "localhost.evil.example:80"), 403U);
  EXPECT_EQ(status("/secret/", "localhost", "http://evil.example"), 403U);
  EXPECT_EQ(status("/secre", "localhost"), 403U);
  EXPECT_EQ(status("/secreT/", "localhost"), 403U);
  EXPECT_EQ(status("/secret/truth", "localhost"), 404U);
  EXPECT_EQ(status("/secret/held-out/0", "localhost"), 200U);
  EXPECT_EQ(status("/secret/held-out/1", "localhost"), 404U);
}

TEST(ViewService, a_large_scene_stays_on_the_server) {
  viewer::ViewService large(small_scene(), {.title = "t", .max_local_bytes = 1, .truth = {}}, "s", "n");
  const auto reply = large.answer({.method = "GET", .target = "/s/pack", .host = "localhost"});
  EXPECT_EQ(reply.status, 404U);
  EXPECT_NE(
      large.answer({.method = "GET", .target = "/s/", .host = "localhost"}).body.find("\"packed\":false"),
      std::string::npos);
}

std::size_t count(std::string_view text, std::string_view what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string_view::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

/// Names from the scene cannot end the element that holds them, and no mark is left.
TEST(Page, holds_names_of_the_scene_as_data) {
  const std::string page =
      service().answer({.method = "GET", .target = "/secret/", .host = "localhost"}).body;
  EXPECT_EQ(count(page, "</script>"), 4U);
  EXPECT_EQ(count(page, "alert(1)"), 1U);
  for (const char* mark : {"@NONCE@", "@SCENE@", "@PACK@", "@KERNEL@", "@POLICY@", "@SCRIPT@", "@STYLE@"})
    EXPECT_EQ(count(page, mark), 0U) << mark;
  EXPECT_EQ(count(page, "http://") + count(page, "https://"), 0U);
}

TEST(Page, is_never_larger_than_asked) {
  const StoredScene scene = small_scene();
  const auto whole = export_page(scene, {.title = "t"});
  ASSERT_OK(whole);
  EXPECT_FALSE(whole->reduced);
  const auto none = export_page(scene, {.title = "t", .max_bytes = 1000});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::limit);
}

TEST(Base64, is_rfc_4648) {
  const auto text = [](std::string_view plain) {
    return viewer::base64_text({reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()});
  };
  EXPECT_EQ(text(""), "");
  EXPECT_EQ(text("f"), "Zg==");
  EXPECT_EQ(text("fo"), "Zm8=");
  EXPECT_EQ(text("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace symrig::service_test
