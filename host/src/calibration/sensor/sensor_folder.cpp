// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/sensor_folder.hpp"

#include "calibration/sensor/bracket_checks.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/hdr/internal/clipping.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

Error three_channels() {
  return {ErrorCode::bad_value, "dark and flat frames have three channels",
          "give the raw frames of the sensor, with one channel"};
}

/// Reads the frames of one folder, all of one size and depth.
class FrameReader {
 public:
  FrameReader(const fs::path& folder, const CaptureFile& capture, const Progress& progress)
      : folder_(folder), capture_(capture), progress_(progress) {}

  Result<SensorPhotographs> read() {
    const SensorFiles& files = *capture_.sensor;
    SYMRIG_CHECK(tell_bits());
    all_.scene = files.scene;
    if (all_.scene) return read_lit();
    SYMRIG_TRY(all_.dark, all_of(files.dark));
    for (const SensorFiles::Level& level : files.flat) {
      SYMRIG_TRY(auto codes, all_of(level.files));
      all_.flat.push_back(std::move(codes));
    }
    for (const SensorFiles::Still& still : files.bracket) {
      SYMRIG_TRY(auto codes, codes_of(still.file));
      all_.bracket.push_back({std::move(codes), still.exposure, still.file});
    }
    return std::move(all_);
  }

  /// Frames of a scene: two are in memory at a time.
  Result<MeasuredSensor> measure_scene() {
    const SensorFiles& files = *capture_.sensor;
    SYMRIG_CHECK(tell_bits());
    std::optional<SceneTransfer> transfer;
    for (const SensorFiles::Level& level : files.dark_levels)
      SYMRIG_CHECK(pass_level(level, false, transfer));
    for (const SensorFiles::Level& level : files.flat) SYMRIG_CHECK(pass_level(level, true, transfer));
    if (transfer) return examine_scene(*transfer);
    return Error{ErrorCode::bad_value, "[sensor] names no frames",
                 "give [[sensor.dark]] and [[sensor.flat]] (docs/sensor.md)"};
  }

 private:
  /// The lit frames of a scene, as a bracket.
  Result<SensorPhotographs> read_lit() {
    for (const SensorFiles::Level& level : capture_.sensor->flat) {
      SYMRIG_TRY(auto frames, all_of(level.files));
      for (std::size_t k = 0; k < frames.size(); ++k)
        all_.bracket.push_back({std::move(frames[k]), level.exposure, level.files[k]});
    }
    return std::move(all_);
  }

  Result<void> pass_level(const SensorFiles::Level& level, bool lit, std::optional<SceneTransfer>& transfer) {
    for (std::size_t k = 0; k + 1 < level.files.size(); k += 2) {
      SYMRIG_TRY(const auto first, codes_of(level.files[k]));
      SYMRIG_TRY(const auto second, codes_of(level.files[k + 1]));
      if (all_.channels != 1) return three_channels();
      if (!transfer) transfer.emplace(all_.grid, all_.bits);
      if (k == 0) SYMRIG_CHECK(transfer->begin({lit, level.exposure}));
      SYMRIG_CHECK(transfer->add(first, second));
      done_ += 2;
      if (progress_ && !progress_({"reading", done_, 0})) return stopped();
    }
    return {};
  }

  Error stopped() const {
    return {ErrorCode::interrupted, "reading of " + folder_.string() + " was stopped"};
  }

  /// Sets the bits of a code. Raw files have those of their layout; pictures those of [sensor], in files of 8
  /// or 16 bits.
  Result<void> tell_bits() {
    all_.bits = capture_.sensor->bits;
    if (capture_.raw) {
      const int raw = capture_.raw->bits > 0 ? capture_.raw->bits : capture_.raw->format->bits;
      if (all_.bits == 0) all_.bits = raw;
      if (all_.bits != raw)
        return Error{ErrorCode::bad_value,
                     fmt::format("{}: sensor.bits is {}, [raw] has {}", capture_.path, all_.bits, raw),
                     "remove sensor.bits"};
    }
    if (all_.bits > 0) return {};
    return Error{ErrorCode::bad_value, capture_.path + ": the number of bits of a code is not given",
                 "give [sensor] bits, or [raw]"};
  }

  Result<std::vector<SensorPhotographs::Codes>> all_of(const std::vector<std::string>& files) {
    std::vector<SensorPhotographs::Codes> all;
    for (const std::string& file : files) {
      SYMRIG_TRY(auto codes, codes_of(file));
      all.push_back(std::move(codes));
      if (progress_ && !progress_({"reading", ++done_, 0})) return stopped();
    }
    return all;
  }

  /// Colours stay as they are: their mean is no code. Grey that is stored as colour is one channel.
  static Result<Image<float>> read_picture(const fs::path& file) {
    SYMRIG_TRY(Image<float> image, read_image(file));
    for (int channel = 1; channel < image.channels(); ++channel)
      if (!std::ranges::equal(image.plane(channel), image.plane(0))) return image;
    if (image.channels() == 1) return image;
    Image<float> grey(image.grid());
    std::ranges::copy(image.plane(0), grey.plane(0).begin());
    return grey;
  }

  Result<SensorPhotographs::Codes> codes_of(const std::string& file) {
    const bool raw = image::lower_suffix(file) == ".raw";
    SYMRIG_TRY(const Image<float> image,
               raw ? read_captured(folder_ / file, capture_) : read_picture(folder_ / file));
    if (!all_.grid.valid()) all_.grid = image.grid(), all_.channels = image.channels(), first_ = file;
    if (image.channels() != all_.channels)
      return Error{
          ErrorCode::size_mismatch,
          fmt::format("{} has {} channels; {} has {}", file, image.channels(), first_, all_.channels),
          "use frames of one camera in one format"};
    if (image.grid() != all_.grid)
      return Error{
          ErrorCode::size_mismatch,
          fmt::format("{} is {}; {} is {}", file, to_string(image.grid()), first_, to_string(all_.grid)),
          "use frames of one camera at one size"};
    const int stored = raw ? all_.bits : all_.bits <= 8 ? 8 : 16;
    const auto largest = static_cast<float>((1U << static_cast<unsigned>(stored)) - 1);
    SensorPhotographs::Codes codes;
    codes.reserve(image.values().size());
    for (const float value : image.values())
      codes.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * largest)));
    const std::uint16_t most = codes.empty() ? std::uint16_t{0} : *std::ranges::max_element(codes);
    if (most < 1U << static_cast<unsigned>(all_.bits)) return codes;
    return Error{ErrorCode::bad_value,
                 fmt::format("{}: code {} does not fit in {} bits", file, most, all_.bits),
                 "correct the bits of [sensor]; codes use the low bits of a 16-bit picture"};
  }

  const fs::path& folder_;
  const CaptureFile& capture_;
  const Progress& progress_;
  SensorPhotographs all_;
  std::string first_;
  std::int64_t done_ = 0;
};

SensorFrames frames_of(const SensorPhotographs& photographs) {
  SensorFrames frames;
  frames.grid = photographs.grid;
  frames.bits = photographs.bits;
  frames.dark.assign(photographs.dark.begin(), photographs.dark.end());
  for (const auto& level : photographs.flat) frames.flat.emplace_back(level.begin(), level.end());
  return frames;
}

}  // namespace

std::vector<Frame> bracket_of(const SensorPhotographs& photographs) {
  std::vector<Frame> frames;
  for (const auto& still : photographs.bracket) frames.push_back({still.codes, still.exposure});
  return frames;
}

std::optional<int> clipping_of(std::span<const Frame> bracket, const std::optional<Sensor>& sensor) {
  if (!sensor) return hdr::clipping_of_bracket(bracket, {});
  const NoiseModel& noise = sensor->noise;
  return hdr::clipping_of_bracket(bracket,
                                  hdr::LinearCodes{noise.pedestal(), noise.gain() * noise.read_noise()});
}

bool clip_as_seen(std::span<const Frame> bracket, Sensor& sensor) {
  const auto clipping = clipping_of(bracket, sensor);
  if (!clipping || *clipping >= sensor.noise.saturation_code()) return false;
  sensor.noise = sensor.noise.clipped_at(*clipping);
  sensor.clipping_seen = true;
  return true;
}

ResponseOptions usable_codes(const SensorPhotographs& photographs, const std::optional<Sensor>& sensor) {
  constexpr double kSigmas = 5;
  ResponseOptions options;
  options.bits = photographs.bits;
  if (!sensor) {
    options.high = clipping_of(bracket_of(photographs), sensor).value_or(options.high);
    return options;
  }
  const NoiseModel& noise = sensor->noise;
  options.low = static_cast<int>(noise.pedestal() + kSigmas * noise.gain() * noise.read_noise());
  options.high = noise.saturation_code();
  return options;
}

namespace {

Result<CaptureFile> read_sensor_capture(const fs::path& folder) {
  SYMRIG_TRY(CaptureFile capture, read_capture_file(folder / "capture.toml"));
  capture.response.reset();  // this needs codes, not light
  if (capture.sensor) return capture;
  return Error{ErrorCode::bad_value, capture.path + ": it has no table [sensor]",
               "name the dark and flat frames there (docs/sensor.md)"};
}

}  // namespace

Result<SensorPhotographs> read_sensor_folder(const fs::path& folder, const Progress& progress) {
  SYMRIG_TRY(const CaptureFile capture, read_sensor_capture(folder));
  return FrameReader(folder, capture, progress).read();
}

Result<MeasuredSensor> measure_sensor_folder(const fs::path& folder, const Progress& progress) {
  SYMRIG_TRY(const CaptureFile capture, read_sensor_capture(folder));
  FrameReader reader(folder, capture, progress);
  if (capture.sensor->scene) return reader.measure_scene();
  SYMRIG_TRY(const SensorPhotographs photographs, reader.read());
  MeasuredSensor measured;
  SYMRIG_TRY(measured.findings, examine_sensor(photographs));
  measured.grid = photographs.grid;
  measured.dark_frames = std::ssize(photographs.dark);
  measured.flat_levels = std::ssize(photographs.flat);
  measured.bracket = std::ssize(photographs.bracket);
  return measured;
}

Result<MeasuredSensor> examine_scene(SceneTransfer& transfer) {
  // Copied, not moved: GCC 12 takes an optional that is moved out of for one that was never set.
  const Result<SceneSensor> scene = transfer.finish();
  if (!scene) return scene.error();
  MeasuredSensor measured{{}, scene->grid, scene->dark_frames, scene->lit_levels};
  SensorFindings& findings = measured.findings;
  findings.sensor = scene->sensor;
  findings.linearity = scene->linearity;
  findings.response = scene->response;
  findings.response_doubt = scene->response_doubt;
  findings.scene = static_cast<const SceneFacts&>(*scene);
  return measured;
}

Result<SensorFindings> examine_sensor(const SensorPhotographs& photographs) {
  const bool frames = !photographs.dark.empty() || !photographs.flat.empty();
  if (!frames && photographs.bracket.empty())
    return Error{ErrorCode::bad_value, "[sensor] names no frames",
                 "give dark and [[sensor.flat]], or [[sensor.bracket]]"};
  if (frames && photographs.channels != 1) return three_channels();
  SensorFindings findings;
  if (frames) {
    SYMRIG_TRY(findings.sensor, measure_sensor(frames_of(photographs)));
  }
  if (photographs.bracket.empty()) return findings;
  SYMRIG_CHECK(calibration::check_bracket_order(photographs));
  const std::vector<Frame> bracket = bracket_of(photographs);
  if (findings.sensor) {
    clip_as_seen(bracket, *findings.sensor);
    SYMRIG_TRY(findings.linearity, test_linearity(bracket, findings.sensor->noise));
    findings.sensor->nonlinearity = findings.linearity->worst;
    if (findings.linearity->linear()) return findings;
  }
  SYMRIG_TRY(RecoveredResponse recovered,
             recover_response(bracket, usable_codes(photographs, findings.sensor)));
  findings.response = std::move(recovered.curve);
  findings.response_doubt = recovered.doubt;
  if (!findings.sensor) findings.straight = recovered.straight;
  return findings;
}

namespace {

namespace fs = std::filesystem;

/// Two bytes a code, the low one first: V4L2's Y16 on every machine.
std::vector<std::byte> bytes_of(std::span<const std::uint16_t> codes) {
  std::vector<std::byte> bytes;
  bytes.reserve(2 * codes.size());
  for (const std::uint16_t code : codes) {
    bytes.push_back(static_cast<std::byte>(code & 0xFFU));
    bytes.push_back(static_cast<std::byte>(code >> 8U));
  }
  return bytes;
}

}  // namespace

Result<SensorRecord> SensorRecord::make(fs::path folder, Grid grid, int bits) {
  std::error_code error;
  if (fs::exists(folder / "capture.toml", error))
    return Error{ErrorCode::bad_argument, fmt::format("{} has a capture.toml already", folder.string()),
                 "give a new folder: it may describe other photographs"};
  return SensorRecord(std::move(folder), fmt::format("# Frames of a sensor's measurement: docs/sensor.md\n"
                                                     "symrig = 1\n\n"
                                                     "[raw]\nformat = \"Y16\"\nsize = \"{}x{}\"\nbits = {}\n"
                                                     "justified = \"low\"\n\n[sensor]\nlight = \"scene\"\n",
                                                     grid.cols, grid.rows, bits));
}

void SensorRecord::end_level() {
  if (frames_ > 0) text_ += fmt::format("files = [{}]\n", files_);
  files_.clear();
  frames_ = 0;
}

Result<void> SensorRecord::begin(const SceneLevel& level) {
  std::error_code error;
  if (!fs::is_directory(folder_, error) && !fs::create_directory(folder_, error))
    return Error{ErrorCode::io, fmt::format("{}: {}", folder_.string(), error.message()),
                 "give a folder that can be made"};
  end_level();
  name_ = fmt::format("{}{:02}", level.lit ? "lit" : "dark", levels_++);
  text_ += fmt::format("\n[[sensor.{}]]\nexposure = \"{}\"\n", level.lit ? "flat" : "dark",
                       base::duration_text(level.exposure));
  return {};
}

Result<void> SensorRecord::add(std::span<const std::uint16_t> first, std::span<const std::uint16_t> second) {
  SYMRIG_CHECK(add(first));
  return add(second);
}

Result<void> SensorRecord::add(std::span<const std::uint16_t> codes) {
  const std::string file = fmt::format("{}-{:03}.raw", name_, frames_);
  files_ += fmt::format("{}\"{}\"", frames_ == 0 ? "" : ", ", file);
  ++frames_;
  return write_file_atomically(folder_ / file, bytes_of(codes));
}

Result<void> SensorRecord::finish() {
  end_level();
  return write_file_atomically(folder_ / "capture.toml", text_);
}

}  // namespace symrig
