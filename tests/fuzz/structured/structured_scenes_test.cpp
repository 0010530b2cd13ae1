// SPDX-License-Identifier: Apache-2.0
// Scene files with other values, shapes and types in them: refused in one line, or read as the scene that
// they now are, with which everything that commands do works.
#include "campaign.hpp"
#include "mutators.hpp"
#include "scratch.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/report/html_report.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "unit/tensor/random_tensor.hpp"
#include "unit/tensor/small_camera.hpp"

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace symrig::structured::structured_scenes_test {
namespace {

namespace fs = std::filesystem;

constexpr int kChannels = 2;

TransportTensor symmetric_tensor() {
  return tests::RandomTensor({5, 6}, {}, true, kChannels, 3, 0.1).with_band(true).make(2, 2, 12).tensor;
}

TransportTensor general_tensor() {
  return tests::RandomTensor({5, 6}, {4, 3}, false, kChannels, 5, 0.1).make(1, 2, 9).tensor;
}

/// What brute force measures.
TransportTensor measured_columns() {
  TensorBuilder builder(BlockTree(Grid{3, 4}), BlockTree(Grid{3, 4}), kChannels);
  const std::vector<std::int32_t> rows{0, 3, 7, 11};
  const std::vector<float> values{1, 2, 3, 4, 0.5F, 0.25F, 0.1F, 0.2F};
  for (std::int32_t col = 0; col < 12; col += 2) builder.add_column(col, col + 2, rows, values);
  return std::move(builder).finish();
}

/// Four views, cut views first.
TransportTensor viewed_tensor() {
  TensorBuilder builder(*BlockTree::make({6, 6}, {{2, 2}, SplitOrder::views_first, {}}), kChannels);
  const std::vector<float> ones(std::size_t{2} * kChannels * 36, 0.5F);
  builder.add_leaf(0, 36, 0, 36, 1, 0, ones);
  for (std::int32_t i = 0; i < 36; i += 5) builder.add_scalar(i, i, std::vector<float>(kChannels, 2.F));
  builder.add_empty(1, 1, 0);
  return std::move(builder).finish();
}

StoredScene scene_of(TransportTensor tensor) {
  StoredScene scene;
  scene.tensor = std::move(tensor);
  scene.capture_json =
      R"({"command":"capture","scene":"sim:plane","algorithm":"symrig","patterns":37,"frames":99,)"
      R"("patterns_brute_force":30,"patterns_per_level":[1,2,3],"error_per_level":[0.5,0.2],"rig_seconds":1.5,)"
      R"("estimated_error":{"frobenius":0.01,"relight":{"bar":0.1}},"seconds":{"total":1,"process":0.5,"merge":0.1},)"
      R"("peak_memory_bytes":100000,"stopped_by":"done","noise":"off"})";
  for (int k = 0; k < 2; ++k) {
    HeldOut held{"pair " + std::to_string(k), Image<float>(scene.tensor.projector_grid(), 1, 0.5F), {}};
    held.photograph = *scene.tensor.apply(held.pattern);
    scene.held_out.push_back(std::move(held));
  }
  scene.camera = std::make_shared<const CameraTransport>(
      *CameraTransport::make(test::small_camera(scene.tensor.channels(), scene.tensor.projector_tree())));
  return scene;
}

/// Scene files as they should be, and their tensors.
class StructuredScenes : public testing::Test {
 protected:
  struct Original {
    fs::path file;
    TransportTensor tensor;
  };

  void SetUp() override {
    add(scene_of(symmetric_tensor()));
    add(scene_of(general_tensor()));
    add(scene_of(measured_columns()));
    add(scene_of(viewed_tensor()));
  }

  void add(const StoredScene& scene) {
    originals_.push_back({folder_ / ("whole" + std::to_string(originals_.size()) + ".h5"), scene.tensor});
    ASSERT_TRUE(save_scene(originals_.back().file, scene).ok());
    ASSERT_TRUE(load_scene(originals_.back().file).ok());
  }

  test::Scratch folder_;
  std::vector<Original> originals_;
};

Image<float> random_light(Grid grid, Random& random) {
  Image<float> light(grid);
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  return light;
}

double inner(const Image<float>& a, const Image<float>& b, int channel) {
  double sum = 0;
  for (std::size_t i = 0; i < a.plane(0).size(); ++i)
    sum += static_cast<double>(a.plane(0)[i]) * static_cast<double>(b.plane(channel)[i]);
  return sum;
}

void expect_finite(const Image<float>& image, const char* what) {
  for (const float v : image.values())
    if (!std::isfinite(v)) {
      FAIL() << what << " is not finite";
    }
}

/// ⟨q, T p⟩ = ⟨Tᵀ q, p⟩. Float sums of n terms, and symmetric leaves that were rounded (2⁻⁹ of what they add
/// up to without signs: the bound of the format), so the sizes of both sides are those of |T|, not of T; they
/// are taken from light of all pixels with the largest photograph.
void expect_adjoint(const TransportTensor& tensor, Random& random) {
  const Image<float> p = random_light(tensor.projector_grid(), random),
                     q = random_light(tensor.camera_grid(), random);
  const auto seen = tensor.apply(p), back = tensor.apply_transposed(q);
  ASSERT_TRUE(seen.ok() && back.ok());
  expect_finite(*seen, "a photograph");
  expect_finite(*back, "a dual photograph");
  double size = 0;
  for (const Leaf& leaf : tensor.leaves())
    size = std::max(size, double(leaf.rows()) * leaf.cols() * leaf.rank);
  double largest = 1e-30;
  const std::vector<float> factors = *tensor.factors();
  const float* at = factors.data();
  for (const Leaf& leaf : tensor.leaves())
    for (int c = 0; c < tensor.channels(); ++c) {
      double a = 0, b = 0;
      for (int k = 0; k < leaf.rank * leaf.rows(); ++k) a = std::max(a, std::abs(double{*at++}));
      for (int k = 0; k < leaf.rank * leaf.cols(); ++k) b = std::max(b, std::abs(double{*at++}));
      largest = std::max(largest, size * a * b);
    }
  for (const float v : tensor.scalar_values()) largest = std::max(largest, std::abs(double{v}));
  for (const float v : tensor.column_values()) largest = std::max(largest, std::abs(double{v}));
  for (const BandLeaf& band : tensor.bands())
    for (const float v : band.values) largest = std::max(largest, std::abs(double{v}));
  const double parts = 2.0 + static_cast<double>(tensor.leaves().size() + tensor.scalars().size() +
                                                 tensor.column_rows().size() * p.values().size());
  for (int c = 0; c < tensor.channels(); ++c) {
    const double bound = 0x1p-8 * parts * largest + 1e-30;
    EXPECT_NEAR(inner(q, *seen, c), inner(p, *back, c), bound);
  }
}

/// All that `symrig report` asks a symmetric tensor for.
void look_inside(const TransportTensor& tensor) {
  for (int level = 0; tensor.symmetric() && level < tensor.levels(); ++level) {
    const auto stopped = tensor.stopped_at(level)->apply(Image<float>(tensor.projector_grid(), 1, 1.0F));
    ASSERT_TRUE(stopped.ok());
    expect_finite(*stopped, "a tensor stopped early");
  }
  for (int row = 0; tensor.symmetric() && row < tensor.camera_grid().rows; ++row) {
    ASSERT_TRUE(tensor.slice(row, tensor.channels() - 1).ok());
    ASSERT_TRUE(tensor.level_map(row).ok());
  }
}

/// If a photograph differs from what it was, evaluate calls the scene wrong against the original.
void expect_judged(const StoredScene& scene, const TransportTensor& original) {
  const TransportTensor& tensor = scene.tensor;
  if (tensor.camera_grid() != original.camera_grid() ||
      tensor.projector_grid() != original.projector_grid() || tensor.channels() != original.channels())
    return;  // evaluate refuses it: not the size of its rig
  const auto errors = evaluate(tensor, [&](const Image<float>& pattern) { return original.apply(pattern); });
  ASSERT_TRUE(errors.ok());
  Random random(1);
  for (int k = 0; k < 4; ++k) {
    const Image<float> light = random_light(tensor.projector_grid(), random);
    const auto now = tensor.apply(light), before = original.apply(light);
    ASSERT_TRUE(now.ok() && before.ok());
    double error = 0, whole = 0;
    for (std::size_t i = 0; i < now->values().size(); ++i) {
      error += std::pow(double{now->values()[i]} - double{before->values()[i]}, 2);
      whole += std::pow(double{before->values()[i]}, 2);
    }
    // ‖(T̃ − T) p‖ ≤ ‖T̃ − T‖ ‖p‖, and evaluate estimates ‖T̃ − T‖ within a factor of 3 from twelve signs.
    const double share = std::sqrt(error / whole);
    if (share > 0.01) {
      EXPECT_GT(errors->frobenius, share / 100);
    }
  }
}

/// `symrig relight --from-view 0,0`, seen from the last view.
void relight_views(const TransportTensor& tensor) {
  const ViewLayout views = tensor.camera_tree().views();
  if (views.single()) return;
  const ViewRelight what{views, View{0, 0}, View{views.rows - 1, views.cols - 1}};
  const auto grid = light_grid(tensor, what);
  if (!grid.ok()) return;
  EXPECT_TRUE(relight(tensor, Image<float>(*grid, 1, 1.0F), what).ok());
}

/// `symrig relight`, and the gradients of the Python module.
void use_camera(const CameraTransport& camera, Random& random) {
  const Image<float> light = random_light(camera.projector_grid(), random);
  const auto photograph = camera.apply(light);
  ASSERT_TRUE(photograph.ok());
  expect_finite(*photograph, "a photograph on camera pixels");
  const std::vector<Image<float>> lights(3, light);
  ASSERT_TRUE(camera.apply_batch(lights).ok());
  ASSERT_TRUE(camera.adjoint(*photograph).ok());
}

void use_as_commands_do(const StoredScene& scene, Random& random) {
  if (scene.camera) use_camera(*scene.camera, random);
  EXPECT_FALSE(inspection_json(scene).empty());
  captured_scene(scene);
  for (const HeldOut& held : scene.held_out) ASSERT_TRUE(held_out_error(scene.tensor, held).ok());
  expect_adjoint(scene.tensor, random);
  look_inside(scene.tensor);
  relight_views(scene.tensor);
  const auto page = html_report(scene, {});
  ASSERT_TRUE(page.ok()) << page.error().line();
}

TEST_F(StructuredScenes, are_refused_in_one_line_or_work) {
  int refused = 0, read = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    const Original& original = originals_[number % originals_.size()];
    const fs::path file = folder_ / "mutated.h5";
    fs::copy_file(original.file, file, fs::copy_options::overwrite_existing);
    SCOPED_TRACE(mutate_scene(file, random));
    const auto scene = load_scene(file);
    scene.ok() ? ++read : ++refused;
    if (!scene.ok()) {
      EXPECT_EQ(exit_code(scene.error().code), 4) << scene.error().line();
      EXPECT_EQ(scene.error().line().find('\n'), std::string::npos);
      EXPECT_NE(scene.error().line().find("mutated.h5"), std::string::npos) << scene.error().line();
      return;
    }
    use_as_commands_do(*scene, random);
    expect_judged(*scene, original.tensor);
  });
  RecordProperty("read", read);
  RecordProperty("refused", refused);
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, read / 10);
    EXPECT_GT(read, refused / 100);
  }
}

}  // namespace
}  // namespace symrig::structured::structured_scenes_test
