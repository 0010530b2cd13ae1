// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registration.hpp"
#include "tensor/h5_file.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace h5 = tensor::h5;
using h5::Handle;
using h5::Object;
using h5::Shape;
using tensor::check_values;
using tensor::damaged;
using tensor::impossible;
using tensor::kLargest;

constexpr std::int32_t kVersionMajor = 1, kVersionMinor = 0;
constexpr int kMostChannels = 64;

constexpr h5::FileWords kWords{.content = "a registration",
                               .name_one = "name a registration.h5",
                               .make_one = "`symrig calibrate --rig RIG` makes registrations",
                               .make_again = "calibrate the rig again"};

std::array<std::int32_t, 2> sides(Grid grid) {
  return {grid.rows, grid.cols};
}

std::int32_t whole(std::int64_t value) {
  return static_cast<std::int32_t>(std::min<std::int64_t>(value, std::numeric_limits<std::int32_t>::max()));
}

bool write_whole(hid_t object, const char* name, std::int64_t value) {
  const std::int32_t one = whole(value);
  return h5::write_attribute(object, name, std::span(&one, 1));
}

template <class T>
bool write_planes(hid_t place, const char* name, const Image<T>& image) {
  const Shape shape{std::uint64_t(image.channels()), std::uint64_t(image.grid().rows),
                    std::uint64_t(image.grid().cols)};
  return h5::write_dataset<T>(place, name, shape, image.values());
}

bool write_map(hid_t file, std::size_t number, const CameraMap& map) {
  const std::string name = fmt::format("map_{}", number);
  const Handle group = h5::new_group(file, name);
  const CameraMapNumbers n = map.numbers();
  return group.ok() && write_whole(group.id(), "intervals", n.intervals) &&
         h5::write_attribute(group.id(), "error", n.error) &&
         h5::write_attribute(group.id(), "edge_width", n.edge_width) &&
         h5::write_attribute(group.id(), "outlier_share", n.outlier_share) &&
         write_whole(group.id(), "edges", n.edges) &&
         h5::write_dataset<double>(group.id(), "row", {n.row.size()}, n.row) &&
         h5::write_dataset<double>(group.id(), "col", {n.col.size()}, n.col);
}

bool write_gain(hid_t file, const GainRatio& gain) {
  const Handle group = h5::new_group(file, "gain");
  return group.ok() && write_whole(group.id(), "known", gain.known ? 1 : 0) &&
         write_whole(group.id(), "pairs", gain.pairs) &&
         h5::write_attribute(group.id(), "sigma", gain.sigma) &&
         h5::write_attribute(group.id(), "veil", gain.veil) &&
         h5::write_attribute(group.id(), "veil_sigma", gain.veil_sigma) &&
         h5::write_dataset<double>(group.id(), "shape", {gain.shape.size()}, gain.shape);
}

bool write_blur(hid_t file, const OpticsBlur& blur) {
  const Handle group = h5::new_group(file, "blur");
  return group.ok() && write_whole(group.id(), "measured", blur.measured ? 1 : 0) &&
         h5::write_attribute(group.id(), "projector", blur.projector) &&
         h5::write_attribute(group.id(), "camera", blur.camera) &&
         h5::write_attribute(group.id(), "sigma", blur.sigma);
}

bool write_ghost(hid_t file, const CameraGhost& ghost) {
  const Handle group = h5::new_group(file, "ghost");
  const std::array<double, 2> place{ghost.place.row, ghost.place.col};
  return group.ok() && h5::write_attribute(group.id(), "share", ghost.share) &&
         h5::write_attribute(group.id(), "sigma", ghost.sigma) &&
         h5::write_attribute(group.id(), "significance", ghost.significance) &&
         h5::write_dataset<double>(group.id(), "place", {2}, place);
}

bool write_reciprocity(hid_t file, const ReciprocalShift& shift) {
  const Handle group = h5::new_group(file, "reciprocity");
  return group.ok() && h5::write_attribute(group.id(), "corrected", shift.corrected) &&
         h5::write_attribute(group.id(), "left", shift.left);
}

bool write_all(hid_t file, const Registration& r) {
  bool ok = h5::write_attribute(file, "format", std::string("symrig-registration")) &&
            write_whole(file, "version_major", kVersionMajor) &&
            write_whole(file, "version_minor", kVersionMinor) && h5::write_attribute(file, "rig", r.rig) &&
            h5::write_attribute(file, "cells", sides(r.cells)) &&
            h5::write_attribute(file, "camera", sides(r.camera())) &&
            write_whole(file, "channels", r.flood.mean.channels()) &&
            write_whole(file, "maps", static_cast<std::int64_t>(r.maps.size())) &&
            write_whole(file, "photographs", r.photographs) && write_planes(file, "flood", r.flood.mean) &&
            write_planes(file, "flood_variance", r.flood.variance) &&
            write_planes(file, "flood_valid", r.flood.valid) && write_planes(file, "shares", r.shares) &&
            write_planes(file, "stripes", r.stripes);
  if (r.shift) {
    const std::array<double, 2> shift{r.shift->row, r.shift->col};
    ok = ok && h5::write_dataset<double>(file, "shift", {2}, shift);
  }
  ok = ok && write_gain(file, r.gain) && write_blur(file, r.blur);
  if (r.ghost.found) ok = ok && write_ghost(file, r.ghost);
  if (r.reciprocity.measured) ok = ok && write_reciprocity(file, r.reciprocity);
  for (std::size_t k = 0; ok && k < r.maps.size(); ++k) ok = write_map(file, k, r.maps[k]);
  return ok;
}

Result<std::int32_t> read_whole(const Object& object, const char* name, std::int32_t least,
                                std::int32_t most) {
  SYMRIG_TRY(const auto values, h5::read_integers(object, name, 1));
  if (values[0] < least || values[0] > most)
    return damaged(fmt::format("attribute '{}' is {}, not in {}..{}", name, values[0], least, most));
  return values[0];
}

template <class T>
Result<Image<T>> read_planes(const Object& file, const char* name, Grid grid, int channels) {
  Shape shape;
  SYMRIG_TRY(const auto values, h5::read_dataset<T>(file, name, 3, shape));
  if (shape != Shape{std::uint64_t(channels), std::uint64_t(grid.rows), std::uint64_t(grid.cols)})
    return damaged(fmt::format("dataset '{}' does not fit the camera's grid", name));
  Image<T> image(grid, channels);
  std::ranges::copy(values, image.values().begin());
  return image;
}

Result<Radiance> read_flood(const Object& file, Grid camera, int channels) {
  Radiance flood;
  SYMRIG_TRY(flood.mean, read_planes<float>(file, "flood", camera, channels));
  SYMRIG_TRY(flood.variance, read_planes<float>(file, "flood_variance", camera, channels));
  SYMRIG_TRY(flood.valid, read_planes<std::uint8_t>(file, "flood_valid", camera, channels));
  SYMRIG_CHECK(check_values(flood.mean.values(), "dataset 'flood'", kLargest));
  SYMRIG_CHECK(check_values(flood.variance.values(), "dataset 'flood_variance'", kLargest));
  for (std::size_t i = 0; i < flood.mean.values().size(); ++i) {
    const float mean = flood.mean.values()[i], variance = flood.variance.values()[i];
    const std::uint8_t valid = flood.valid.values()[i];
    if (variance < 0 || valid > 1 || (valid == 0 && (mean != 0 || variance != 0)))
      return impossible("the flood-lit photograph has a value that no photograph has");
  }
  return flood;
}

Result<CameraMap> read_map(const Object& file, std::int32_t number, Grid camera) {
  const std::string name = fmt::format("map_{}", number);
  SYMRIG_TRY(const Object group, h5::open_group(file, name));
  constexpr std::int32_t kAny = std::numeric_limits<std::int32_t>::max();
  CameraMapNumbers n;
  n.camera = camera;
  SYMRIG_TRY(n.intervals, read_whole(group, "intervals", 1, kAny));
  SYMRIG_TRY(n.error, h5::read_number(group, "error"));
  SYMRIG_TRY(n.edge_width, h5::read_number(group, "edge_width"));
  SYMRIG_TRY(n.outlier_share, h5::read_number(group, "outlier_share"));
  SYMRIG_TRY(n.edges, read_whole(group, "edges", 0, kAny));
  Shape shape;
  SYMRIG_TRY(n.row, h5::read_dataset<double>(group, "row", 1, shape));
  SYMRIG_TRY(n.col, h5::read_dataset<double>(group, "col", 1, shape));
  return CameraMap::make(n);
}

Result<GainRatio> read_gain(const Object& file) {
  SYMRIG_TRY(const Object group, h5::open_group(file, "gain"));
  GainRatio gain;
  SYMRIG_TRY(const std::int32_t known, read_whole(group, "known", 0, 1));
  SYMRIG_TRY(gain.pairs, read_whole(group, "pairs", 0, std::numeric_limits<std::int32_t>::max()));
  SYMRIG_TRY(gain.sigma, h5::read_number(group, "sigma"));
  SYMRIG_TRY(gain.veil, h5::read_number(group, "veil"));
  SYMRIG_TRY(gain.veil_sigma, h5::read_number(group, "veil_sigma"));
  Shape shape;
  SYMRIG_TRY(const auto values, h5::read_dataset<double>(group, "shape", 1, shape));
  if (values.size() != gain.shape.size()) return damaged("dataset 'gain/shape' does not have 4 numbers");
  // log g of a sum of four shapes that are at most 1: a gain within e^±40.
  const auto sane = [](double v) { return std::abs(v) < 10; };
  if (!std::ranges::all_of(values, sane) || !sane(gain.sigma) || !sane(gain.veil) || !sane(gain.veil_sigma) ||
      gain.sigma < 0 || gain.veil_sigma < 0)
    return impossible("the gain ratio has a number that no gain ratio has");
  gain.known = known == 1;
  std::ranges::copy(values, gain.shape.begin());
  return gain;
}

Result<OpticsBlur> read_blur(const Object& file) {
  SYMRIG_TRY(const Object group, h5::open_group(file, "blur"));
  OpticsBlur blur;
  SYMRIG_TRY(const std::int32_t measured, read_whole(group, "measured", 0, 1));
  SYMRIG_TRY(blur.projector, h5::read_number(group, "projector"));
  SYMRIG_TRY(blur.camera, h5::read_number(group, "camera"));
  SYMRIG_TRY(blur.sigma, h5::read_number(group, "sigma"));
  for (const double v : {blur.projector, blur.camera, blur.sigma})
    if (!(v >= 0 && v <= 100)) return impossible("a blur is not between 0 and 100 cells");
  blur.measured = measured == 1;
  return blur;
}

Result<CameraGhost> read_ghost(const Object& file, Grid cells) {
  SYMRIG_TRY(const Object group, h5::open_group(file, "ghost"));
  CameraGhost ghost;
  SYMRIG_TRY(ghost.share, h5::read_number(group, "share"));
  SYMRIG_TRY(ghost.sigma, h5::read_number(group, "sigma"));
  SYMRIG_TRY(ghost.significance, h5::read_number(group, "significance"));
  Shape shape;
  SYMRIG_TRY(const auto place, h5::read_dataset<double>(group, "place", 1, shape));
  if (place.size() != 2) return damaged("dataset 'ghost/place' does not have 2 numbers");
  ghost.place = {place[0], place[1]};
  const bool near = std::abs(place[0]) <= cells.rows && std::abs(place[1]) <= cells.cols;
  if (!(ghost.share > 0 && ghost.share <= CameraGhost::largest_share) || !near ||
      !(ghost.sigma >= 0 && ghost.sigma <= 1) ||
      !(ghost.significance >= 0 && std::isfinite(ghost.significance)))
    return impossible("the ghost has a number that no ghost has");
  ghost.found = true;
  return ghost;
}

Result<ReciprocalShift> read_reciprocity(const Object& file) {
  SYMRIG_TRY(const Object group, h5::open_group(file, "reciprocity"));
  ReciprocalShift shift;
  SYMRIG_TRY(shift.corrected, h5::read_number(group, "corrected"));
  SYMRIG_TRY(shift.left, h5::read_number(group, "left"));
  for (const double v : {shift.corrected, shift.left})
    if (!(v >= 0 && v <= 100)) return impossible("a shift is not between 0 and 100 cells");
  shift.measured = true;
  return shift;
}

Result<Registration> read_all(const Object& file) {
  SYMRIG_TRY(const std::string format, h5::read_text(file, "format"));
  if (format != "symrig-registration")
    return Error{ErrorCode::bad_format, fmt::format("its format is '{}', not 'symrig-registration'", format),
                 "name a registration.h5"};
  SYMRIG_TRY(const auto version, h5::read_integers(file, "version_major", 1));
  if (version[0] != kVersionMajor)
    return Error{ErrorCode::bad_format,
                 fmt::format("file version {}, this program reads version {}", version[0], kVersionMajor),
                 "calibrate the rig again"};
  constexpr std::int32_t kAny = std::numeric_limits<std::int32_t>::max();
  Registration r;
  SYMRIG_TRY(r.rig, h5::read_text(file, "rig"));
  SYMRIG_TRY(r.cells, h5::read_grid(file, "cells"));
  SYMRIG_TRY(const Grid camera, h5::read_grid(file, "camera"));
  // Each cell has a pixel. This bounds the memory that a file of some size asks for.
  if (r.cells.size() > camera.size())
    return damaged(
        fmt::format("it has {} cells for {} camera pixels", to_string(r.cells), to_string(camera)));
  SYMRIG_TRY(const std::int32_t channels, read_whole(file, "channels", 1, kMostChannels));
  SYMRIG_TRY(r.photographs, read_whole(file, "photographs", 0, kAny));
  SYMRIG_TRY(r.flood, read_flood(file, camera, channels));
  SYMRIG_TRY(const std::int32_t maps, read_whole(file, "maps", 1, channels));
  if (maps != 1 && maps != channels)
    return damaged(fmt::format("it has {} maps for {} channels", maps, channels));
  SYMRIG_TRY(r.shares, read_planes<float>(file, "shares", camera, 2 * maps));
  SYMRIG_TRY(r.stripes, read_planes<float>(file, "stripes", camera, 2 * channels));
  SYMRIG_CHECK(check_values(r.stripes.values(), "dataset 'stripes'", kLargest));
  SYMRIG_TRY(const bool has_shift, h5::exists(file, "shift"));
  if (has_shift) {
    Shape shape;
    SYMRIG_TRY(const auto shift, h5::read_dataset<double>(file, "shift", 1, shape));
    if (shift.size() != 2 || r.camera() != r.cells) return damaged("dataset 'shift' does not fit the grids");
    r.shift = Point{shift[0], shift[1]};
  }
  SYMRIG_TRY(r.gain, read_gain(file));
  SYMRIG_TRY(r.blur, read_blur(file));
  SYMRIG_TRY(const bool has_reciprocity, h5::exists(file, "reciprocity"));
  if (has_reciprocity) {
    SYMRIG_TRY(r.reciprocity, read_reciprocity(file));
  }
  SYMRIG_TRY(const bool has_ghost, h5::exists(file, "ghost"));
  if (has_ghost) {
    SYMRIG_TRY(r.ghost, read_ghost(file, r.cells));
  }
  for (std::int32_t k = 0; k < maps; ++k) {
    SYMRIG_TRY(CameraMap map, read_map(file, k, camera));
    r.maps.push_back(std::move(map));
  }
  return r;
}

}  // namespace

Result<void> save_registration(const std::filesystem::path& path, const Registration& registration) {
  return h5::write_file(path, [&](hid_t file) { return write_all(file, registration); });
}

Result<Registration> load_registration(const std::filesystem::path& path) {
  return h5::read_file(path, kWords, read_all);
}

}  // namespace symrig
