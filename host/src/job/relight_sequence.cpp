// SPDX-License-Identifier: Apache-2.0

#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/job/relight.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

namespace symrig::job {

namespace {

/// What the pictures of an output folder are made of. A resumed job trusts only pictures that it lists.
struct SequenceFile {
  std::string scene;                              ///< SHA-256
  std::string asked;                              ///< as SequenceOutput::asked
  double exposure = 0;                            ///< 0: pictures of radiance
  std::map<std::string, std::uint32_t> pictures;  ///< file name → light_digest of its light

  /// fails: io, bad_format (not such a file; names it).  Nothing if there is none.
  static Result<std::optional<SequenceFile>> read(const std::filesystem::path& folder);
  Result<void> write(const std::filesystem::path& folder) const;
};

using SequenceJson = nlohmann::ordered_json;

constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 28;  // two million pictures

std::optional<SequenceFile> parsed(const SequenceJson& json) {
  if (!json.is_object() || !json.contains("scene") || !json["scene"].is_string() || !json.contains("asked") ||
      !json["asked"].is_string() || !json.contains("exposure") || !json["exposure"].is_number() ||
      !json.contains("lights") || !json["lights"].is_object())
    return {};
  SequenceFile file{json["scene"], json["asked"], json["exposure"], {}};
  for (const auto& [picture, light] : json["lights"].items()) {
    if (!light.is_number_unsigned()) return {};
    file.pictures[picture] = light.get<std::uint32_t>();
  }
  return file;
}

Result<std::optional<SequenceFile>> SequenceFile::read(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kSequenceFile;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::optional<SequenceFile>();
  SYMRIG_TRY(const auto bytes, read_file(path, kLargestFile));
  const SequenceJson json = SequenceJson::parse(bytes.begin(), bytes.end(), nullptr, false);
  std::optional<SequenceFile> file = parsed(json);
  if (!file)
    return Error{ErrorCode::bad_format, path.string() + " is not a list of relit pictures",
                 "give an empty folder, or remove that file"};
  return file;
}

Result<void> SequenceFile::write(const std::filesystem::path& folder) const {
  SequenceJson lights = SequenceJson::object();
  for (const auto& [picture, light] : pictures) lights[picture] = light;
  const SequenceJson json{{"scene", scene}, {"asked", asked}, {"exposure", exposure}, {"lights", lights}};
  return write_file_atomically(folder / kSequenceFile, json.dump(1) + "\n");
}

/// CRC-32C of a light's values: an accidental change is seen.
std::uint32_t light_digest(const Image<float>& light) {
  return acquisition::fast_crc32c(std::as_bytes(light.values()));
}

}  // namespace

}  // namespace symrig::job

namespace symrig {

namespace {

namespace fs = std::filesystem;

/// The light of each number; read on all processors.
Result<std::vector<Image<float>>> read_lights(const LightSequence& lights, std::size_t first,
                                              std::size_t count) {
  std::vector<Result<Image<float>>> read(count, Error{ErrorCode::bad_argument, "not read"});
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) { read[k] = lights.read(first + k); });
  std::vector<Image<float>> pictures;
  pictures.reserve(count);
  for (Result<Image<float>>& one : read) {
    SYMRIG_TRY(Image<float> light, std::move(one));
    pictures.push_back(std::move(light));
  }
  return pictures;
}

/// Where pictures go, one batch after another. has() may be called while add() runs.
class Sink {
 public:
  virtual ~Sink() = default;
  /// True if the picture of this light is there already.
  virtual bool has(std::size_t number, const Image<float>& light) const = 0;
  /// numbers, lights, pictures: of the same length.
  virtual Result<void> add(std::span<const std::size_t> numbers, std::span<const Image<float>> lights,
                           std::span<const Image<float>> pictures) = 0;
  virtual Result<void> finish() = 0;
  /// What an interrupted job leaves.
  virtual Error interrupted(std::size_t done, std::size_t all) const = 0;
};

/// Lights that are relit together, without those whose pictures are there already.
struct Batch {
  std::vector<std::size_t> numbers;
  std::vector<Image<float>> lights, pictures;
  std::size_t kept = 0;  ///< pictures that are there already
};

Result<Batch> read_batch(const LightSequence& lights, std::size_t begin, const Sink& sink) {
  const std::size_t count = std::min(Relighter::kBatch, lights.size() - begin);
  SYMRIG_TRY(std::vector<Image<float>> read, read_lights(lights, begin, count));
  Batch batch;
  for (std::size_t k = 0; k < count; ++k) {
    if (sink.has(begin + k, read[k])) continue;
    batch.numbers.push_back(begin + k);
    batch.lights.push_back(std::move(read[k]));
  }
  batch.kept = count - batch.numbers.size();
  return batch;
}

/// Writes one batch while the next is relit.
class Writing {
 public:
  explicit Writing(Sink& sink) : sink_(sink) {}
  Writing(const Writing&) = delete;
  Writing& operator=(const Writing&) = delete;
  ~Writing() { tasks_.wait(); }

  void begin(Batch batch) {
    batch_ = std::move(batch);
    tasks_.run([this] { written_ = sink_.add(batch_.numbers, batch_.lights, batch_.pictures); });
  }
  /// The batch that begin() got.  fails: as Sink::add.
  Result<Batch> finish() {
    tasks_.wait();
    SYMRIG_CHECK(written_);
    return std::move(batch_);
  }

 private:
  Sink& sink_;
  Batch batch_;
  Result<void> written_;
  tbb::task_group tasks_;
};

class FilmSink final : public Sink {
 public:
  FilmSink(Y4mWriter film, double exposure) : film_(std::move(film)), exposure_(exposure) {}

  bool has(std::size_t, const Image<float>&) const override { return false; }
  Result<void> add(std::span<const std::size_t>, std::span<const Image<float>>,
                   std::span<const Image<float>> pictures) override {
    std::vector<std::vector<char>> frames(pictures.size());
    tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t k) {
      frames[k] = Y4mWriter::planes_of(to_display(pictures[k], exposure_));
    });
    for (const std::vector<char>& frame : frames) SYMRIG_CHECK(film_.add_planes(frame));
    return {};
  }
  Result<void> finish() override { return film_.finish(); }
  Error interrupted(std::size_t done, std::size_t all) const override {
    return {ErrorCode::interrupted,
            fmt::format("stopped after {} of {} pictures; no film was written", done, all),
            "run it again; pictures in a folder can be resumed"};
  }

 private:
  Y4mWriter film_;
  double exposure_;
};

class FolderSink final : public Sink {
 public:
  FolderSink(const LightSequence& lights, const SequenceOutput& output, job::SequenceFile file)
      : lights_(lights), output_(output), file_(std::move(file)), earlier_(file_.pictures) {}

  bool has(std::size_t number, const Image<float>& light) const override {
    const std::string name = lights_.name(number) + output_.suffix;
    const auto listed = earlier_.find(name);
    std::error_code ignored;
    return listed != earlier_.end() && listed->second == job::light_digest(light) &&
           fs::exists(output_.path / name, ignored);
  }

  Result<void> add(std::span<const std::size_t> numbers, std::span<const Image<float>> lights,
                   std::span<const Image<float>> pictures) override {
    std::vector<Result<void>> written(numbers.size());
    tbb::parallel_for(std::size_t{0}, numbers.size(),
                      [&](std::size_t k) { written[k] = write(lights_.name(numbers[k]), pictures[k]); });
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      SYMRIG_CHECK(written[k]);
      file_.pictures[lights_.name(numbers[k]) + output_.suffix] = job::light_digest(lights[k]);
    }
    return file_.write(output_.path);
  }

  Result<void> finish() override { return {}; }
  Error interrupted(std::size_t done, std::size_t all) const override {
    return {ErrorCode::interrupted,
            fmt::format("stopped; {} of {} pictures are in {}", done, all, output_.path.string()),
            "resume makes the others"};
  }

 private:
  Result<void> write(const std::string& light, const Image<float>& picture) const {
    const fs::path path = output_.path / (light + output_.suffix);
    if (output_.suffix == ".png") return write_display_png(path, picture, file_.exposure);
    if (output_.suffix != ".exr") return write_image(path, picture);
    PictureFacts facts = output_.facts;
    facts.light = light;
    facts.exposure = automatic_exposure(picture);
    return write_image(path, picture, facts);
  }

  const LightSequence& lights_;
  const SequenceOutput& output_;
  job::SequenceFile file_;
  const decltype(job::SequenceFile::pictures) earlier_;  ///< of earlier calls: add() may run beside has()
};

/// Makes the output folder, and checks that it is neither the lights' nor in use.
Result<job::SequenceFile> open_folder(const LightSequence& lights, const SequenceOutput& output,
                                      double exposure) {
  if (!has_picture_suffix("picture" + output.suffix))
    return Error{ErrorCode::bad_argument, fmt::format("pictures cannot end in '{}'", output.suffix),
                 "use .exr, .pfm or .png"};
  std::error_code error;
  if (fs::exists(output.path, error) && !fs::is_directory(output.path, error))
    return Error{ErrorCode::bad_argument, fmt::format("{} is not a folder", output.path.string()),
                 "give a folder for the pictures, or a .y4m film"};
  if (!fs::exists(output.path, error) && !fs::create_directory(output.path, error))
    return Error{ErrorCode::not_found,
                 fmt::format("the folder {} cannot be made ({})", output.path.string(), error.message()),
                 "make the folder that it lies in"};
  if (fs::equivalent(output.path, lights.path(), error))
    return Error{ErrorCode::bad_argument, fmt::format("{} is the folder of the lights", output.path.string()),
                 "give another folder: pictures get the names of their lights"};

  job::SequenceFile file{output.facts.scene, output.asked, exposure, {}};
  SYMRIG_TRY(const std::optional<job::SequenceFile> old, job::SequenceFile::read(output.path));
  if (old && output.resume) {
    if (old->scene != file.scene || old->asked != file.asked || old->exposure != file.exposure)
      return Error{
          ErrorCode::bad_argument,
          fmt::format("{} has pictures of {}", output.path.string(),
                      old->scene != file.scene   ? "another scene"
                      : old->asked != file.asked ? fmt::format("another request ({})", old->asked)
                                                 : fmt::format("another exposure ({:.6g})", old->exposure)),
          "give another folder, or the same scene and options as before"};
    return *old;
  }
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const fs::path picture = output.path / (lights.name(k) + output.suffix);
    if (old || fs::exists(picture, error))
      return Error{ErrorCode::bad_argument, fmt::format("{} has pictures already", output.path.string()),
                   old ? "resume makes those that are missing, or give another folder"
                       : fmt::format("give another folder, or remove {}", picture.filename().string())};
  }
  return file;
}

Result<double> exposure_of(const Relighter& relighter, const SequenceOutput& output) {
  const bool shown = is_film(output.path) || output.suffix == ".png";
  if (!shown) return 0.0;
  if (output.exposure) return *output.exposure;
  SYMRIG_TRY(const Image<float> flood, relighter.flood_lit());
  return automatic_exposure(flood);
}

/// A film that cannot be resumed, because it appears as a whole.
Result<void> check_resume(const SequenceOutput& output) {
  if (!output.resume || !is_film(output.path)) return {};
  return Error{ErrorCode::bad_argument, "a film is written as a whole, so it cannot be resumed",
               "write pictures to a folder: they can be resumed"};
}

}  // namespace

Result<SequenceResult> relight_sequence(const Relighter& relighter, const LightSequence& lights,
                                        const SequenceOutput& output, const Progress& progress) {
  SYMRIG_CHECK(check_resume(output));
  SequenceResult result;
  SYMRIG_TRY(result.exposure, exposure_of(relighter, output));

  result.grid = relighter.picture_grid();
  result.channels = relighter.picture_channels();
  std::unique_ptr<Sink> sink;
  if (is_film(output.path)) {
    SYMRIG_TRY(Y4mWriter film, Y4mWriter::begin(output.path, result.grid, result.channels,
                                                lights.rate().value_or(FrameRate{})));
    sink = std::make_unique<FilmSink>(std::move(film), result.exposure);
  } else {
    SYMRIG_TRY(job::SequenceFile file, open_folder(lights, output, result.exposure));
    sink = std::make_unique<FolderSink>(lights, output, std::move(file));
  }

  Writing writing(*sink);
  const auto finish_batch = [&]() -> Result<void> {
    SYMRIG_TRY(const Batch written, writing.finish());
    result.kept += written.kept;
    result.pictures += written.kept + written.numbers.size();
    const ProgressEvent so_far{"relighting", static_cast<std::int64_t>(result.pictures),
                               static_cast<std::int64_t>(lights.size()), kNoneToCome};
    if (progress && !progress(so_far)) return sink->interrupted(result.pictures, lights.size());
    return {};
  };
  for (std::size_t begin = 0; begin < lights.size(); begin += Relighter::kBatch) {
    SYMRIG_TRY(Batch batch, read_batch(lights, begin, *sink));
    SYMRIG_TRY(batch.pictures, relighter.relight_batch(batch.lights));
    if (begin > 0) SYMRIG_CHECK(finish_batch());
    writing.begin(std::move(batch));
  }
  SYMRIG_CHECK(finish_batch());
  SYMRIG_CHECK(sink->finish());
  return result;
}

}  // namespace symrig
