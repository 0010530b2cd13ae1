// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/y4m.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// Reads a light: a picture file, or a built-in light drawn on the grid.
/// Colour becomes luminance (Rec. 709), because projectors show white light here. Any finite value is
/// allowed: T is linear.
/// of: what has this grid, for the message. warning: that colour was lost; left alone otherwise.
/// fails: not_found, bad_format, bad_value, size_mismatch (names both sizes).
Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of,
                                std::string* warning = nullptr);

/// A light that needs no file.
struct BuiltInLight {
  std::string_view name, meaning;
  Image<float> (*draw)(Grid grid);
};
std::span<const BuiltInLight> built_in_lights();

/// Many lights for one scene: the pictures of a folder in the order of their names, or the frames of a film.
class LightSequence {
 public:
  /// path: a folder with .exr, .png or .pfm pictures (other files are ignored), or a .y4m film.
  /// grid, of: the size that each light must have, and what has it, for messages.
  /// fails: not_found, io, bad_argument (no picture; two with one name but for the suffix), and as
  /// Y4mReader::open; size_mismatch (a film of another size).
  static Result<LightSequence> open(const std::filesystem::path& path, Grid grid, const std::string& of);

  const std::filesystem::path& path() const { return path_; }
  std::size_t size() const { return film_ ? film_->frames() : pictures_.size(); }
  /// The name of a light without folder and suffix: "spot", and in a film "walk-00012" for its twelfth frame.
  std::string name(std::size_t light) const;
  /// Of a film.
  std::optional<FrameRate> rate() const;

  /// One channel of linear light. Lights may be read by several threads at once.
  /// fails: as read_light.
  Result<Image<float>> read(std::size_t light) const;

 private:
  LightSequence() = default;

  std::filesystem::path path_;
  Grid grid_;
  std::string of_;
  std::vector<std::filesystem::path> pictures_;
  std::optional<Y4mReader> film_;
};

/// What is asked of a scene.
struct RelightOptions {
  ViewRelight views = {};
  std::optional<BayerPattern> mosaic = {};  ///< the scene was measured as a raw mosaic: give colour pictures
};

/// Relights one scene, as a job asks for it.
class Relighter {
 public:
  /// So many lights are relit with one pass over T (TransportTensor::apply_batch).
  static constexpr std::size_t kBatch = 16;

  /// fails: as light_grid; bad_argument (a mosaic of a scene in colour, or of single views).
  static Result<Relighter> begin(std::shared_ptr<const TransportOperator> tensor,
                                 const RelightOptions& options);
  static Result<Relighter> begin(TransportTensor tensor, const RelightOptions& options);
  /// Pictures on the camera's own pixels, with their colours if it has a mosaic. fails: unknown_name.
  static Result<Relighter> begin(std::shared_ptr<const CameraTransport> camera);

  Grid light_grid() const { return light_grid_; }
  Grid picture_grid() const { return picture_grid_; }
  int picture_channels() const { return options_.mosaic ? 3 : tensor_->channels(); }

  /// photograph = T · light.  shapes, error, fails: as symrig::relight. With a mosaic it has 3 channels, as
  /// colour_by_flood makes them.
  Result<Image<float>> relight(const Image<float>& light) const;
  /// The same for many lights. The last bits may differ.
  Result<std::vector<Image<float>>> relight_batch(std::span<const Image<float>> lights) const;

  /// The scene under a light of 1 everywhere.
  Result<Image<float>> flood_lit() const;

 private:
  Relighter() = default;
  Result<Image<float>> in_colour(Image<float> photograph) const;

  std::shared_ptr<const TransportOperator> tensor_;
  RelightOptions options_;
  Grid light_grid_, picture_grid_;
  std::optional<Radiance> flood_mosaic_;  ///< with a mosaic only
  Image<float> factors_;                  ///< colour_factors(), of a camera with a mosaic only
};

/// Where the pictures of many lights go.
struct SequenceOutput {
  std::filesystem::path path;   ///< a .y4m film, or a folder, which is made if only it is missing
  std::string suffix = ".exr";  ///< of pictures in a folder: .exr, .pfm, or .png for viewing
  std::optional<double>
      exposure;         ///< of .png and films; empty: that of the flood-lit scene (automatic_exposure)
  bool resume = false;  ///< goes on where an earlier call with the same scene stopped (a folder only)
  std::string asked =
      {};  ///< what else the pictures depend on, such as views; a resumed call must ask the same
  PictureFacts facts = {};  ///< of .exr files; scene must be set. The light is filled in.
};

struct SequenceResult {
  std::size_t pictures = 0;  ///< in the output now
  std::size_t kept = 0;      ///< of them from an earlier call
  Grid grid;
  int channels = 1;
  double exposure = 1;
};

/// The name of the file, beside the pictures, that says what they are made of (docs/command-line.md, "Many
/// lights").
inline constexpr const char* kSequenceFile = "relight.json";

/// Relights a scene with each light of a sequence; reads T once for Relighter::kBatch lights. Pictures of a
/// folder are written atomically; so is a film. A picture is kept by a resumed call if scene, request and
/// light are the same.
/// fails: bad_argument (no known suffix; the folder of the lights; the folder has pictures and resume is not
/// set, or they are of another scene or request); interrupted (says how many pictures are written); as
/// LightSequence::read, write_image and Y4mWriter.
Result<SequenceResult> relight_sequence(const Relighter& relighter, const LightSequence& lights,
                                        const SequenceOutput& output, const Progress& progress = {});

/// SHA-256 of a file, as sha256sum prints it.  fails: as read_file.
Result<std::string> file_hash(const std::filesystem::path& path);

}  // namespace symrig
