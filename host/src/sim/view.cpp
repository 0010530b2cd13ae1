// SPDX-License-Identifier: Apache-2.0
#include "sim/view.hpp"

#include "sim/scenes.hpp"

#include <utility>

namespace symrig::sim {
namespace {

/// A camera that shares the projector's cells: see = T light.
class CoaxialView final : public View {
 public:
  explicit CoaxialView(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {}
  Grid camera() const override { return scene_->grid(); }
  int channels() const override { return scene_->channels(); }
  Image<float> see(const Image<float>& light, std::uint64_t /*shown_before*/) const override {
    return scene_->apply(light);
  }

 private:
  std::shared_ptr<const Scene> scene_;
};

}  // namespace

bool is_bench(const SceneUri& uri) {
  const SceneUri none;
  return uri.own_camera() || uri.turn != 0 || uri.zoom != 1 || uri.shift != none.shift ||
         uri.distortion != 0 || uri.parallax != 0 || uri.vignetting != none.vignetting ||
         uri.defocus != none.defocus || uri.colour != 0 || uri.ghost.share != 0 || uri.moves != 0;
}

Result<Bench> make_bench(const SceneUri& uri) {
  Bench bench;
  if (!is_bench(uri)) {
    SYMRIG_TRY(bench.truth, make_scene(uri));
    bench.view = std::make_unique<CoaxialView>(bench.truth);
    return bench;
  }
  SYMRIG_TRY(auto made, make_points(uri));
  const std::shared_ptr<const Scene> points = std::move(made);
  bench.truth = uri.fine == 1 ? points : cell_scene(uri, points);
  bench.view = bench_view(uri, points);
  return bench;
}

}  // namespace symrig::sim
