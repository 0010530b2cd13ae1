// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/evaluation.hpp"

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/camera_errors.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The tensor must be of the rig's grid and channels.
Result<void> check_same(const TransportOperator& tensor, Grid rig, int channels) {
  if (rig == tensor.camera_grid() && rig == tensor.projector_grid() && channels == tensor.channels())
    return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the rig is {} with {} channels, the scene file {} with {}", to_string(rig),
                           channels, to_string(tensor.camera_grid()), tensor.channels()),
               "give the rig that the scene was captured from"};
}

Error other_camera(const CameraTransport& camera, Grid rig) {
  return {ErrorCode::size_mismatch,
          fmt::format("the rig's camera has {} pixels, the scene's {}", to_string(rig),
                      to_string(camera.camera_grid())),
          "give the rig that the scene was captured from"};
}

/// Of a camera with a mosaic, three channels, and each pixel valid in its own.
class SplitMosaic final : public ForwardingProbe {
 public:
  SplitMosaic(Probe& rig, const BayerPattern& filters) : ForwardingProbe(rig), filters_(filters) {}

  int channels() const override { return 3; }

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern> /*patterns*/,
                                     Result<std::vector<Radiance>> photographs) override {
    if (!photographs) return photographs;
    for (Radiance& one : *photographs) {
      SYMRIG_TRY(one, split_mosaic(one, filters_));
    }
    return photographs;
  }
  BayerPattern filters_;
};

}  // namespace

namespace {

/// Of the rig that the camera was captured from.
Result<CameraTruth> truth_of_camera(const CameraTransport& camera, const std::string& rig) {
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(auto truth, camera_truth(uri));
  if (!truth) return other_camera(camera, camera.projector_grid());
  const Grid corners = truth->corners.front().grid(), pixels{corners.rows - 1, corners.cols - 1};
  if (pixels != camera.camera_grid()) return other_camera(camera, pixels);
  return *std::move(truth);
}

Result<ErrorEstimate> judge_camera(const CameraTransport& camera, const CameraTruth& truth,
                                   const SeenCells& seen, const Progress& progress) {
  EvaluateOptions options;
  options.seen = [&seen](const Image<float>* lit) {
    return lit == nullptr ? seen.counted() : seen.dark(*lit);
  };
  return measure_errors(camera, told(truth.photograph, progress), options);
}

}  // namespace

Result<ErrorEstimate> judge_camera_by_truth(const CameraTransport& camera, const std::string& rig,
                                            const Progress& progress) {
  SYMRIG_TRY(const CameraTruth truth, truth_of_camera(camera, rig));
  return judge_camera(camera, truth, SeenCells(camera, truth.corners), progress);
}

Result<ErrorEstimate> judge_camera_by_rig(const CameraTransport& camera, RegisteredProbe& rig,
                                          const Progress& progress) {
  const Registration* registration = rig.registration();
  if (registration == nullptr || registration->camera() != camera.camera_grid())
    return other_camera(camera, rig.camera().camera_grid());
  if (fmt::format("{:08x}", rig.digest()) != camera.parts().registration)
    return Error{ErrorCode::bad_argument,
                 "the rig was registered again since the capture, so its pixels look elsewhere",
                 "give the registration of the capture, or capture again"};
  const SeenCells seen = SeenCells(camera, registration->corners());
  EvaluateOptions options;
  options.seen = [&seen](const Image<float>* lit) {
    return lit == nullptr ? seen.counted() : seen.dark(*lit);
  };
  if (!rig.mosaic()) return measure_errors(camera, rig.camera(), options, progress);
  SplitMosaic split(rig.camera(), *rig.mosaic());
  return measure_errors(camera, split, options, progress);
}

Result<Judged> judge_by_truth(const TransportOperator& tensor, const std::string& rig,
                              const Progress& progress) {
  SYMRIG_TRY(const std::shared_ptr<const Scene> truth, open_truth(rig));
  SYMRIG_CHECK(check_same(tensor, truth->grid(), truth->channels()));
  SYMRIG_TRY(ErrorEstimate ideal, measure_errors(tensor, told(truth_of(truth), progress)));
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(const auto bench, bench_truth(uri));
  if (!bench) return Judged{std::move(ideal), rig};
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, told(*bench, progress)));
  return Judged{std::move(errors), rig, std::move(ideal)};
}

namespace {

/// The pictures where samples count, and 0 elsewhere.
TrueTransport masked(TrueTransport picture_of, std::vector<char> counted) {
  return [picture_of = std::move(picture_of),
          counted = std::move(counted)](const Image<float>& light) -> Result<Image<float>> {
    SYMRIG_TRY(Image<float> picture, picture_of(light));
    for (std::size_t i = 0; i < counted.size(); ++i)
      if (counted[i] == 0) picture.values()[i] = 0;
    return picture;
  };
}

}  // namespace

namespace {

Result<OwnPixelsShown> own_pixels_shown(const std::shared_ptr<const CameraTransport>& camera) {
  SYMRIG_TRY(Relighter made, Relighter::begin(camera));
  const auto relighter = std::make_shared<const Relighter>(std::move(made));
  return OwnPixelsShown{[relighter](const Image<float>& light) { return relighter->relight(light); }};
}

/// Pixels that see something beside the cells have a row, but the cells' light is not all that they see.
Result<void> add_truth(const CameraTransport& camera, const std::string& rig, const Progress& progress,
                       OwnPixelsShown& shown) {
  SYMRIG_TRY(const CameraTruth truth, truth_of_camera(camera, rig));
  const SeenCells seen(camera, truth.corners);
  SYMRIG_TRY(shown.errors, judge_camera(camera, truth, seen, progress));
  shown.truth = masked(truth.photograph, seen.counted());
  shown.relit = masked(std::move(shown.relit), seen.counted());
  return {};
}

/// The truth on the cells: of a bench, through its exact map.
Result<TrueTransport> truth_on_cells(const StoredScene& scene, const std::string& rig) {
  SYMRIG_TRY(const std::shared_ptr<const Scene> truth, open_truth(rig));
  if (!check_same(scene.tensor, truth->grid(), truth->channels()))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("The file states the rig {}, but its grid or its channels differ", rig), ""};
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(const auto bench, bench_truth(uri));
  return bench ? *bench : truth_of(truth);
}

}  // namespace

Result<void> add_truths(const StoredScene& scene, ReportOptions& options) {
  if (scene.camera) {
    SYMRIG_TRY(options.own_pixels, own_pixels_shown(scene.camera));
  }
  const std::string rig = captured_scene(scene);
  if (!is_simulated(rig)) return {};
  if (auto truth = truth_on_cells(scene, rig))
    options.truth = *std::move(truth);
  else
    options.no_truth = truth.error().what + ".";
  if (!scene.camera) return {};
  Result<void> added = add_truth(*scene.camera, rig, options.progress, *options.own_pixels);
  if (added) return {};
  if (added.error().code == ErrorCode::interrupted) return added;
  if (options.no_truth.empty()) options.no_truth = added.error().what + ".";
  return {};
}

TrueTransport true_transport_of(const StoredScene& scene) {
  const std::string rig = captured_scene(scene);
  if (!is_simulated(rig)) return {};
  auto truth = open_truth(rig);
  if (!truth || !check_same(scene.tensor, (*truth)->grid(), (*truth)->channels())) return {};
  return truth_of(*std::move(truth));
}

Result<Judged> judge_by_rig(const TransportOperator& tensor, Probe& rig, const Progress& progress) {
  SYMRIG_CHECK(check_aligned(rig));
  SYMRIG_CHECK(check_same(tensor, rig.grid(), rig.channels()));
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, rig, {}, progress));
  return Judged{std::move(errors), rig.describe()};
}

Result<std::vector<HeldOutError>> judge_by_photographs(const TransportOperator& tensor,
                                                       std::span<const HeldOut> held_out) {
  std::vector<HeldOutError> errors;
  errors.reserve(held_out.size());
  for (const HeldOut& one : held_out) {
    SYMRIG_TRY(HeldOutError error, held_out_error(tensor, one));
    errors.push_back(std::move(error));
  }
  return errors;
}

Result<std::vector<HeldOutError>> judge_by_photographs(const StoredScene& scene) {
  return judge_by_photographs(scene.tensor, scene.held_out);
}

}  // namespace symrig
