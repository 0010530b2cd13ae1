// SPDX-License-Identifier: Apache-2.0
// The page of a scene with T on the camera's own pixels: what its server answers, and where the cells lie on
// the picture.
#include "assert_ok.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/tensor/internal/half.hpp"
#include "symrig/viewer/page.hpp"
#include "turned_camera.hpp"
#include "viewer/camera_view.hpp"
#include "viewer/view_service.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::camera_test {
namespace {

using test::TurnedCamera;

std::shared_ptr<const CameraTransport> made(const TurnedCamera& camera) {
  return std::make_shared<const CameraTransport>(*CameraTransport::make(camera.parts()));
}

/// The farthest that a cell of the picture is taken to be from its place. units: pixels of the camera along
/// an axis.
double farthest(const TurnedCamera& camera) {
  const viewer::CellPlaces places = viewer::cell_places(*made(camera));
  double most = 0;
  for (int cell = 0; cell < camera.cells.size(); ++cell) {
    const int row = cell / camera.cells.cols, col = cell % camera.cells.cols;
    const auto [x, y] = camera.place((col + 0.5) / camera.cells.cols, (row + 0.5) / camera.cells.rows);
    if (std::min(x, y) < 0 || std::max(x, y) > 1) continue;
    most = std::max({most, std::abs(x - static_cast<double>(places.x[cell])) * camera.camera.cols,
                     std::abs(y - static_cast<double>(places.y[cell])) * camera.camera.rows});
  }
  return most;
}

/// Pixels lie up to half a pixel to one side of the place of which they are the mean, and a median does not
/// leave the range of its values. Beside the border, the cells around lie on one side, where the lens bends
/// places by less than another half pixel.
TEST(CellPlaces, are_known_of_any_camera) {
  EXPECT_LT(farthest({}), 1);
  EXPECT_LT(farthest({.turn = 0, .zoom = 1, .bend = 0}), 0.5001);
  EXPECT_LT(farthest({.turn = -37, .zoom = 0.6}), 1);
  EXPECT_LT(farthest({.turn = 180, .zoom = 0.9, .mosaic = "GRBG"}), 1);
  // Cells that the picture's border cuts: half a cell.
  EXPECT_LT(farthest({.zoom = 1.2, .misled = true}), 1.2 * 200 / 32 / 2);
}

TEST(CellPlaces, hardly_depend_on_cells_that_are_taken_for_others) {
  EXPECT_LT(farthest({.misled = true}), 1);
}

TEST(CellPlaces, of_no_pixels_are_those_of_the_picture) {
  CameraTransport::Parts parts;
  parts.cells = BlockTree(Grid{2, 2});
  parts.camera = {4, 4};
  parts.groups = {{0, 0, 1}};
  parts.pixels = {5};
  parts.brightness = {1};
  const viewer::CellPlaces places = viewer::cell_places(*CameraTransport::make(std::move(parts)));
  EXPECT_EQ(places.x, (std::vector<float>{0.25F, 0.75F, 0.25F, 0.75F}));
  EXPECT_EQ(places.y, (std::vector<float>{0.25F, 0.25F, 0.75F, 0.75F}));
}

/// Light that tells each cell from all others.
Image<float> some_light(Grid grid) {
  Image<float> light(grid);
  for (std::size_t i = 0; i < light.values().size(); ++i)
    light.values()[i] = static_cast<float>((i * 37 + 11) % 64) / 64;
  return light;
}

TEST(CameraView, shows_what_relight_writes) {
  for (const char* mosaic : {"", "RGGB", "GBRG"}) {
    const auto camera = made({.mosaic = mosaic});
    const auto view = viewer::CameraView::make(camera);
    ASSERT_TRUE(view);
    EXPECT_FALSE(view->quick_grid());
    const auto relighter = Relighter::begin(camera);
    ASSERT_OK(relighter);
    const Image<float> light = some_light({24, 32});
    const auto ours = view->relit(light), theirs = relighter->relight(light);
    ASSERT_OK(ours);
    ASSERT_OK(theirs);
    ASSERT_EQ(ours->channels(), *mosaic == 0 ? 1 : 3);
    ASSERT_EQ(ours->channels(), theirs->channels());
    // The factor of a colour, and its product with the light, are rounded once each.
    constexpr float kEps = std::numeric_limits<float>::epsilon();
    for (std::size_t i = 0; i < theirs->values().size(); ++i)
      ASSERT_NEAR(ours->values()[i], theirs->values()[i], 2 * kEps * theirs->values()[i]) << mosaic << i;
  }
}

TEST(CameraView, has_quick_pictures_of_some_of_its_pixels) {
  for (const char* mosaic : {"", "RGGB"}) {
    const auto view = viewer::CameraView::make(made({.mosaic = mosaic}), 5000);
    ASSERT_TRUE(view && view->quick_grid());
    const Grid quick = *view->quick_grid(), whole{180, 200};
    EXPECT_LE(quick.size(), 5000);
    EXPECT_GT(quick.size(), 4000);
    const auto few = view->relit_quickly(some_light({24, 32})), all = view->relit(some_light({24, 32}));
    ASSERT_OK(few);
    ASSERT_OK(all);
    ASSERT_EQ(few->channels(), all->channels());
    for (int channel = 0; channel < few->channels(); ++channel)
      for (int row = 0; row < quick.rows; ++row)
        for (int col = 0; col < quick.cols; ++col)
          ASSERT_EQ(few->at(row, col, channel),
                    all->at((2 * row + 1) * whole.rows / (2 * quick.rows),
                            (2 * col + 1) * whole.cols / (2 * quick.cols), channel));
  }
}

StoredScene scene_of(const TurnedCamera& camera) {
  TensorBuilder builder(BlockTree(camera.cells), camera.mosaic.empty() ? 1 : 3);
  const std::vector<float> value(camera.mosaic.empty() ? 1 : 3, 0.5F);
  for (std::int32_t i = 0; i < camera.cells.size(); ++i) builder.add_scalar(i, i, value);
  StoredScene scene;
  scene.tensor = std::move(builder).finish();
  scene.camera = made(camera);
  return scene;
}

class CameraPage : public ::testing::Test {
 protected:
  viewer::ViewReply get(const std::string& what) {
    const std::string target = "/s/" + what;
    return service.answer({.method = "GET", .target = target, .host = "localhost"});
  }
  viewer::ViewReply post(const std::string& what, const std::string& body) {
    const std::string target = "/s/" + what;
    return service.answer({.method = "POST", .target = target, .host = "localhost", .body = body});
  }
  static std::string bytes_of(const Image<float>& light) {
    std::string bytes;
    const std::uint32_t head[4]{1, 1, 0, static_cast<std::uint32_t>(light.values().size())};
    bytes.append(reinterpret_cast<const char*>(head), sizeof head);
    for (const float value : light.values()) {
      const tensor::Half half = tensor::to_half(value);
      bytes.append(reinterpret_cast<const char*>(&half), sizeof half);
    }
    return bytes;
  }
  /// The planes of a reply against values, to the error of a plane (append_plane()).
  static void expect_planes(const viewer::ViewReply& reply, const Image<float>& expected) {
    ASSERT_EQ(reply.status, 200U) << reply.body;
    std::string planes;
    for (int channel = 0; channel < expected.channels(); ++channel)
      viewer::append_plane(planes, expected.plane(channel));
    EXPECT_EQ(reply.body.size(), planes.size());
    EXPECT_TRUE(reply.body == planes);
  }

  TurnedCamera camera;
  viewer::ViewService service{scene_of(camera), {.title = "t", .truth = {}}, "s", "n"};
};

TEST_F(CameraPage, has_the_cameras_pixels) {
  const auto facts = nlohmann::json::parse(get("facts").body);
  EXPECT_EQ(facts.at("pixels"), "camera");
  EXPECT_EQ(facts.at("camera"), nlohmann::json::array({180, 200}));
  EXPECT_EQ(facts.at("projector"), nlohmann::json::array({24, 32}));
  EXPECT_EQ(facts.at("packed"), false);
  EXPECT_EQ(get("pack").status, 404U);
  const Image<float> light = some_light(camera.cells);
  expect_planes(post("relight", bytes_of(light)), *scene_of(camera).camera->apply(light));
  Image<float> half = light;
  for (float& value : half.values()) value /= 2;
  expect_planes(post("dual", bytes_of(light)), half);  // on the cells
}

TEST_F(CameraPage, tells_where_the_cells_are) {
  const auto reply = get("places");
  ASSERT_EQ(reply.body.size(), 4U * (6 + 2 * 24 * 32));
  float middle[2];  // of cell (12, 16): beside the middle of the picture
  for (std::size_t axis = 0; axis < 2; ++axis)
    std::memcpy(&middle[axis], reply.body.data() + 4 * (6 + axis * 24 * 32 + 12 * 32UL + 16), 4);
  const auto [x, y] = camera.place(16.5 / 32, 12.5 / 24);
  EXPECT_NEAR(middle[0], x, 1.0 / 200);
  EXPECT_NEAR(middle[1], y, 1.0 / 180);
}

TEST_F(CameraPage, tells_which_light_a_pixel_sees) {
  const auto t = scene_of(camera).camera;
  for (const int pixel : {0, 90 * 200 + 100, 120 * 200 + 71}) {
    Image<float> unit(t->camera_grid());
    unit.values()[pixel] = 1;
    expect_planes(get("sees/" + std::to_string(pixel)), *t->adjoint(unit));
  }
}

TEST_F(CameraPage, refuses_anything_else) {
  for (const char* what : {"sees/36000", "sees/-1", "sees/", "sees/1x", "sees/99999999999999999999",
                           "sees/0x1", "quick", "places/", "sees"})
    EXPECT_EQ(get(what).status, 404U) << what;
  for (const char* what : {"quick", "places", "sees/1"})
    EXPECT_EQ(post(what, bytes_of(some_light(camera.cells))).status, 404U) << what;
  EXPECT_EQ(post("relight", bytes_of(some_light(camera.camera))).status, 400U);
  EXPECT_EQ(post("relight", "").status, 400U);
  EXPECT_EQ(get("relight").status, 405U);
  EXPECT_EQ(service.max_body(), viewer::most_light_bytes(camera.cells));
}

/// A scene without them has none of this.
TEST_F(CameraPage, is_of_such_scenes_only) {
  StoredScene plain = scene_of(camera);
  plain.camera = nullptr;
  viewer::ViewService cells(std::move(plain), {.title = "t", .truth = {}}, "s", "n");
  for (const char* what : {"/s/places", "/s/sees/1"})
    EXPECT_EQ(cells.answer({.method = "GET", .target = what, .host = "localhost"}).status, 404U) << what;
  const auto facts = cells.answer({.method = "GET", .target = "/s/facts", .host = "localhost"}).body;
  EXPECT_FALSE(nlohmann::json::parse(facts).contains("pixels"));
  EXPECT_EQ(nlohmann::json::parse(facts).at("packed"), true);
}

TEST(CameraPages, of_a_running_capture_change_at_its_end) {
  const TurnedCamera camera;
  const auto live = std::make_shared<LiveScene>(camera.cells, 1, ViewLayout{});
  viewer::LiveService service(live, {.title = "t", .truth = {}}, "s", "n");
  const auto facts = [&] {
    return nlohmann::json::parse(
        service.answer({.method = "GET", .target = "/s/facts", .host = "localhost"}).body);
  };
  live->show(std::nullopt, [&] { return scene_of(camera).tensor; });
  EXPECT_EQ(facts().at("camera"), nlohmann::json::array({24, 32}));
  live->complete(scene_of(camera), {});
  EXPECT_EQ(facts().at("camera"), nlohmann::json::array({180, 200}));
}

TEST(CameraPages, in_a_file_say_that_they_are_on_the_cells) {
  const auto page = export_page(scene_of({}), {.title = "t"});
  ASSERT_OK(page);
  EXPECT_EQ(page->camera, (Grid{24, 32}));
  EXPECT_NE(page->html.find("\"pixels\":\"cells\""), std::string::npos);
}

}  // namespace
}  // namespace symrig::camera_test
