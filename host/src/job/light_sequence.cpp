// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/light_sequence.hpp"

#include "symrig/image/file.hpp"
#include "symrig/job/light.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace symrig {
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

}  // namespace symrig
