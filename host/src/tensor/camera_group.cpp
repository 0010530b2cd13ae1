// SPDX-License-Identifier: Apache-2.0
// The group `camera` of scene.h5.
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/internal/half.hpp"
#include "tensor/h5_file.hpp"
#include "tensor/h5_write.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::tensor {
namespace {

using CameraParts = CameraTransport::Parts;

constexpr const char* kCameraGroup = "camera";

/// Colours of the filters of 2 x 2 pixels, row by row. "": each pixel sees all channels.
constexpr std::array<std::string_view, 5> kMosaics{"", "RGGB", "GRBG", "GBRG", "BGGR"};

/// what: begins with the name of a part and an apostrophe.
Error damaged_camera(std::string_view what) {
  return damaged(fmt::format("'{}/{}", kCameraGroup, what));
}

template <class T>
Result<std::vector<T>> read_run(const Object& group, const char* name) {
  h5::Shape shape;
  return h5::read_dataset<T>(group, name, 1, shape);
}

/// Rows of three integers.
Result<std::vector<std::array<std::int32_t, 3>>> read_triples(const Object& group, const char* name) {
  h5::Shape shape;
  SYMRIG_TRY(const auto values, h5::read_dataset<std::int32_t>(group, name, 2, shape));
  if (shape[1] != 3) return damaged_camera(fmt::format("{}' does not have three columns", name));
  std::vector<std::array<std::int32_t, 3>> rows(shape[0]);
  for (std::size_t k = 0; k < values.size(); ++k) rows[k / 3][k % 3] = values[k];
  return rows;
}

bool write_triples(hid_t group, const char* name, const std::vector<std::array<std::int32_t, 3>>& rows) {
  const std::int32_t* values = rows.empty() ? nullptr : rows.front().data();
  return h5::write_dataset<std::int32_t>(group, name, {rows.size(), 3}, {values, 3 * rows.size()});
}

template <class T>
bool write_run(hid_t group, const char* name, const std::vector<T>& values) {
  return h5::write_dataset<T>(group, name, {values.size()}, values, h5::Storing::packed);
}

}  // namespace

bool write_camera(hid_t file, const CameraTransport& camera, const Work& work) {
  const CameraParts& parts = camera.parts();
  const h5::Handle place = h5::new_group(file, kCameraGroup);
  if (!place.ok()) return false;
  const hid_t group = place.id();
  const std::array<std::int32_t, 2> grid{parts.camera.rows, parts.camera.cols};
  std::vector<std::array<std::int32_t, 3>> bases, groups;
  for (const LightBasis& basis : parts.bases) bases.push_back({basis.begin, basis.end, basis.rank});
  for (const CameraTransport::Group& one : parts.groups)
    groups.push_back({one.channel, one.columns, one.pixels});
  work.look();
  return h5::write_attribute(group, "grid", grid) &&
         h5::write_dataset<std::int32_t>(group, "size", {2}, grid) &&
         h5::write_attribute(group, "mosaic", parts.mosaic) &&
         h5::write_attribute(group, "registration", parts.registration) &&
         write_triples(group, "bases", bases) && write_run(group, "basis_values", parts.basis_values) &&
         write_triples(group, "groups", groups) && write_run(group, "columns", parts.columns) &&
         write_run(group, "middles", parts.middles) && write_run(group, "steps", parts.steps) &&
         write_run(group, "pixels", parts.pixels) && write_run(group, "brightness", parts.brightness) &&
         write_run(group, "codes", parts.codes) &&
         (parts.chi_square.empty() || write_run(group, "chi_square", parts.chi_square));
}

Result<bool> has_camera(const Object& file, const Head& head) {
  if (!head.may_have_camera) return false;
  return h5::exists(file, kCameraGroup);
}

Result<std::shared_ptr<const CameraTransport>> read_camera(const Object& file, const Head& head,
                                                           const BlockTree& cells) {
  SYMRIG_TRY(const bool is_there, has_camera(file, head));
  if (!is_there) return std::shared_ptr<const CameraTransport>();
  SYMRIG_TRY(const Object group, h5::open_group(file, kCameraGroup));
  CameraParts parts;
  parts.cells = cells;
  parts.channels = head.channels;
  SYMRIG_TRY(parts.camera, h5::read_grid(group, "grid"));
  SYMRIG_TRY(const bool has_size, h5::exists(group, "size"));
  if (has_size) {
    SYMRIG_TRY(const auto size, read_run<std::int32_t>(group, "size"));
    if (!std::ranges::equal(size, std::array{parts.camera.rows, parts.camera.cols}))
      return damaged_camera("size' is not that of 'grid'");
  }
  SYMRIG_TRY(parts.mosaic, h5::read_text(group, "mosaic"));
  SYMRIG_TRY(parts.registration, h5::read_text(group, "registration"));
  if (std::ranges::find(kMosaics, parts.mosaic) == kMosaics.end())
    return damaged_camera(fmt::format("mosaic' is '{}'", parts.mosaic));
  SYMRIG_TRY(const auto bases, read_triples(group, "bases"));
  std::int64_t first = 0;
  for (const auto& [begin, end, rank] : bases) {
    if (rank < 0 || first > INT32_MAX - rank) return damaged_camera("bases' has a rank that is impossible");
    parts.bases.push_back({begin, end, rank, static_cast<std::int32_t>(first)});
    first += rank;
  }
  SYMRIG_TRY(const auto groups, read_triples(group, "groups"));
  for (const auto& [channel, columns, pixels] : groups) parts.groups.push_back({channel, columns, pixels});
  SYMRIG_TRY(parts.basis_values, read_run<Half>(group, "basis_values"));
  SYMRIG_TRY(parts.columns, read_run<std::int32_t>(group, "columns"));
  SYMRIG_TRY(parts.middles, read_run<Half>(group, "middles"));
  SYMRIG_TRY(parts.steps, read_run<Half>(group, "steps"));
  SYMRIG_TRY(parts.pixels, read_run<std::int32_t>(group, "pixels"));
  SYMRIG_TRY(parts.brightness, read_run<float>(group, "brightness"));
  SYMRIG_TRY(parts.codes, read_run<std::int8_t>(group, "codes"));
  SYMRIG_TRY(const bool has_chi_square, h5::exists(group, "chi_square"));
  if (has_chi_square) {
    SYMRIG_TRY(parts.chi_square, read_run<Half>(group, "chi_square"));
  }
  // Pictures of a damaged file must not take all memory: at least one of so many samples has a row.
  constexpr std::int64_t kMostSamplesARow = 1024;
  if (parts.camera.size() * head.channels / kMostSamplesARow > std::ssize(parts.pixels))
    return damaged_camera("grid' is too large for its pixels");
  Result<CameraTransport> camera = CameraTransport::make(std::move(parts));
  if (!camera) return impossible(fmt::format("group '{}': {}", kCameraGroup, camera.error().what));
  return std::make_shared<const CameraTransport>(*std::move(camera));
}

}  // namespace symrig::tensor
