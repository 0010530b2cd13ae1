// SPDX-License-Identifier: Apache-2.0

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace symrig {

namespace {

constexpr std::array<BuiltInLight, 4> kBuiltIn{{
    {"white", "every pixel on", [](Grid grid) { return Image<float>(grid, 1, 1.0F); }},
    {"bar", "a vertical bar, an eighth of the width", [](Grid grid) { return bar_pattern(grid); }},
    {"letters", "the word SYMRIG", [](Grid grid) { return letters_pattern(grid); }},
    {"natural", "a smooth textured picture", [](Grid grid) { return natural_pattern(grid, 1); }},
}};

/// The light is neither a file nor a built-in light.
Error no_light(const std::string& light) {
  std::vector<std::string_view> names;
  names.reserve(kBuiltIn.size());
  for (const BuiltInLight& one : kBuiltIn) names.push_back(one.name);
  return {ErrorCode::not_found,
          fmt::format("there is no file {}, and no built-in light has that name", light),
          fmt::format("{}built-in lights: {}", suggestion(light, names), listed(names))};
}

/// Channels that differ.
bool has_colour(const Image<float>& picture) {
  for (int channel = 1; channel < picture.channels(); ++channel)
    if (!std::ranges::equal(picture.plane(channel), picture.plane(0))) return true;
  return false;
}

}  // namespace

Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of,
                                std::string* warning) {
  for (const BuiltInLight& one : kBuiltIn)
    if (one.name == light) return one.draw(grid);
  std::error_code ignored;
  if (!std::filesystem::exists(light, ignored) && !ignored) return no_light(light);
  SYMRIG_TRY(const Image<float> picture, read_image(light));
  if (picture.grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}, {} is {} (rows x columns)", light, to_string(picture.grid()), of,
                             to_string(grid)),
                 fmt::format("scale the picture to {} rows and {} columns", grid.rows, grid.cols)};
  if (warning != nullptr && has_colour(picture))
    *warning = fmt::format("{} is in colour; its luminance is the light, because patterns are white", light);
  return to_gray(picture);
}

std::span<const BuiltInLight> built_in_lights() {
  return kBuiltIn;
}

namespace {

namespace fs = std::filesystem;

/// The pictures of a folder, by name.
Result<std::vector<fs::path>> pictures_of(const fs::path& folder) {
  std::vector<fs::path> pictures;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (has_picture_suffix(entry->path()) && !has_hidden_name(entry->path()))
      pictures.push_back(entry->path());
  if (error)
    return Error{ErrorCode::io, fmt::format("{} cannot be read ({})", folder.string(), error.message()),
                 "check the folder and its permissions"};
  if (pictures.empty())
    return Error{ErrorCode::bad_argument, fmt::format("{} has no picture", folder.string()),
                 "put lights there: .exr, .png or .pfm, in the order of their names"};
  std::sort(pictures.begin(), pictures.end());
  const auto twice =
      std::adjacent_find(pictures.begin(), pictures.end(),
                         [](const fs::path& a, const fs::path& b) { return a.stem() == b.stem(); });
  if (twice != pictures.end())
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} and {} have one name but for the suffix", twice->string(),
                             std::next(twice)->filename().string()),
                 "rename one: the picture of a light gets its name"};
  return pictures;
}

}  // namespace

Result<LightSequence> LightSequence::open(const fs::path& path, Grid grid, const std::string& of) {
  LightSequence lights;
  lights.path_ = path;
  lights.grid_ = grid;
  lights.of_ = of;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    SYMRIG_TRY(lights.pictures_, pictures_of(path));
    return lights;
  }
  if (!fs::exists(path, ignored))
    return Error{ErrorCode::not_found, fmt::format("there is no folder or film {}", path.string()),
                 "give a folder of pictures, or a .y4m film"};
  SYMRIG_TRY(lights.film_, Y4mReader::open(path));
  if (lights.film_->grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}, {} is {} (rows x columns)", path.string(),
                             to_string(lights.film_->grid()), of, to_string(grid)),
                 fmt::format("scale the film to {} rows and {} columns", grid.rows, grid.cols)};
  return lights;
}

std::string LightSequence::name(std::size_t light) const {
  return film_ ? fmt::format("{}-{:05}", path_.stem().string(), light + 1) : pictures_[light].stem().string();
}

std::optional<FrameRate> LightSequence::rate() const {
  return film_ ? std::optional(film_->rate()) : std::nullopt;
}

Result<Image<float>> LightSequence::read(std::size_t light) const {
  return film_ ? film_->luma(light) : read_light(pictures_[light].string(), grid_, of_);
}

namespace {

Radiance without_noise(Image<float> mean) {
  const Grid grid = mean.grid();
  return {std::move(mean), Image<float>(grid), Image<std::uint8_t>(grid, 1, 1)};
}

Result<void> check_mosaic(const TransportOperator& tensor, const RelightOptions& options) {
  if (!options.mosaic) return {};
  if (tensor.channels() != 1)
    return Error{ErrorCode::bad_argument, "the scene already has colour channels, so it is no raw mosaic",
                 "leave out mosaic"};
  if (options.views.from || options.views.to)
    return Error{ErrorCode::bad_argument, "a raw mosaic cannot be relit from or to a single view",
                 "relight all views at once"};
  return {};
}

}  // namespace

Result<Relighter> Relighter::begin(TransportTensor tensor, const RelightOptions& options) {
  return begin(std::make_shared<const TransportTensor>(std::move(tensor)), options);
}

Result<Relighter> Relighter::begin(std::shared_ptr<const TransportOperator> tensor,
                                   const RelightOptions& options) {
  SYMRIG_CHECK(check_mosaic(*tensor, options));
  Relighter relighter;
  SYMRIG_TRY(relighter.light_grid_, symrig::light_grid(*tensor, options.views));
  SYMRIG_TRY(relighter.picture_grid_, symrig::picture_grid(*tensor, options.views));
  if (options.mosaic) {
    SYMRIG_TRY(Image<float> flood, tensor->apply(Image<float>(tensor->projector_grid(), 1, 1.F)));
    relighter.flood_mosaic_ = without_noise(std::move(flood));
  }
  relighter.tensor_ = std::move(tensor);
  relighter.options_ = options;
  return relighter;
}

Result<Relighter> Relighter::begin(std::shared_ptr<const CameraTransport> camera) {
  Relighter relighter;
  relighter.light_grid_ = camera->projector_grid();
  relighter.picture_grid_ = camera->camera_grid();
  if (!camera->parts().mosaic.empty()) {
    SYMRIG_TRY(const BayerPattern filters, parse_bayer(camera->parts().mosaic));
    SYMRIG_TRY(const Image<float> flood, camera->apply(Image<float>(camera->projector_grid(), 1, 1.F)));
    SYMRIG_TRY(relighter.factors_, colour_factors(flood, filters));
  }
  relighter.tensor_ = std::move(camera);
  return relighter;
}

Result<Image<float>> Relighter::in_colour(Image<float> photograph) const {
  if (!factors_.empty()) return coloured(photograph, factors_);
  if (!flood_mosaic_) return photograph;
  SYMRIG_TRY(Radiance colour,
             colour_by_flood(without_noise(std::move(photograph)), *flood_mosaic_, *options_.mosaic));
  return std::move(colour.mean);
}

Result<Image<float>> Relighter::relight(const Image<float>& light) const {
  SYMRIG_TRY(Image<float> photograph, symrig::relight(*tensor_, light, options_.views));
  return in_colour(std::move(photograph));
}

Result<std::vector<Image<float>>> Relighter::relight_batch(std::span<const Image<float>> lights) const {
  SYMRIG_TRY(std::vector<Image<float>> photographs, symrig::relight_batch(*tensor_, lights, options_.views));
  for (Image<float>& photograph : photographs) {
    SYMRIG_TRY(photograph, in_colour(std::move(photograph)));
  }
  return photographs;
}

Result<Image<float>> Relighter::flood_lit() const {
  return relight(Image<float>(light_grid_, 1, 1.F));
}

Result<std::string> file_hash(const std::filesystem::path& path) {
  SYMRIG_CHECK(check_readable(path));
  const auto failed = [&] {
    return Error{ErrorCode::io, path.string() + ": cannot be read (" + std::strerror(errno) + ")",
                 "check the file and its disk"};
  };
  const Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return failed();
  board::Sha256 hash;
  std::vector<std::byte> block(std::size_t{1} << 20);  // a scene may be larger than the memory
  for (;;) {
    const ::ssize_t count = ::read(file.get(), block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed();
    if (count == 0) return hash.text();
    hash.add(std::span(block).first(static_cast<std::size_t>(count)));
  }
}

}  // namespace symrig
