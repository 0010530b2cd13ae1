// SPDX-License-Identifier: Apache-2.0

#include "viewer/pack.hpp"

#include "symrig/tensor/internal/half.hpp"
#include "symrig/viewer/page.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::viewer {

namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

/// The largest value of a column is near 2^kTop, as in the library's own store.
constexpr int kTop = 7;
/// Sections begin at multiples of this, so that the script can view them as numbers.
constexpr std::size_t kAlignment = 16;

class Packer {
 public:
  template <class T>
  void add(const char* name, std::span<const T> values) {
    pack_.bytes.resize((pack_.bytes.size() + kAlignment - 1) / kAlignment * kAlignment);
    pack_.sections[name] = {pack_.bytes.size(), values.size()};
    const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
    pack_.bytes.insert(pack_.bytes.end(), first, first + values.size_bytes());
  }
  template <class T>
  void add(const char* name, const std::vector<T>& values) {
    add(name, std::span<const T>(values));
  }
  Pack take() && { return std::move(pack_); }

 private:
  Pack pack_;
};

/// Runs of floats as halves with one exponent each.
struct HalfRuns {
  std::vector<tensor::Half> halves;
  std::vector<std::int8_t> exponents;

  void add(std::span<const float> run) {
    halves.resize(halves.size() + run.size());
    const int exponent = tensor::to_halves(run, kTop, halves.data() + halves.size() - run.size());
    exponents.push_back(static_cast<std::int8_t>(std::clamp(exponent, -128, 127)));
  }
};

void pack_leaves(Packer& packer, const PageTensor& tensor) {
  if (tensor.leaves.empty()) return;
  HalfRuns runs;
  const float* at = tensor.factors.data();
  for (const PageLeaf& leaf : tensor.leaves)
    for (int side = 0; side < 2 * tensor.channels; ++side)
      for (std::int32_t k = 0; k < leaf.rank; ++k) {
        const std::size_t pixels = side % 2 == 0 ? leaf.rows() : leaf.cols();
        runs.add({at, pixels});
        at += pixels;
      }
  packer.add("leaves", tensor.leaves);
  packer.add("factorHalves", runs.halves);
  packer.add("factorExponents", runs.exponents);
}

/// values: [entry * channels + channel]. One run a channel.
HalfRuns by_channel(std::span<const float> values, int channels) {
  HalfRuns runs;
  std::vector<float> plane(values.size() / channels);
  for (int c = 0; c < channels; ++c) {
    for (std::size_t k = 0; k < plane.size(); ++k) plane[k] = values[k * channels + c];
    runs.add(plane);
  }
  return runs;
}

void pack_entries(Packer& packer, const PageTensor& tensor) {
  if (tensor.entries.empty()) return;
  std::vector<std::uint32_t> starts(static_cast<std::size_t>(tensor.camera.pixels()) + 1), cols;
  for (const ScalarLeaf& entry : tensor.entries) {
    ++starts[static_cast<std::size_t>(entry.row) + 1];
    cols.push_back(entry.col);
  }
  for (std::size_t row = 1; row < starts.size(); ++row) starts[row] += starts[row - 1];
  const HalfRuns runs = by_channel(tensor.entry_values, tensor.channels);
  packer.add("entryStarts", starts);
  if (tensor.projector.pixels() <= 65536)
    packer.add("entryCols16", std::vector<std::uint16_t>(cols.begin(), cols.end()));
  else
    packer.add("entryCols", cols);
  packer.add("entryHalves", runs.halves);
  packer.add("entryExponents", runs.exponents);
}

/// A plane for each band, channel and offset, in this order.
void pack_bands(Packer& packer, const PageTensor& tensor) {
  if (tensor.bands.empty()) return;
  HalfRuns runs;
  std::vector<std::int32_t> planes;  // channel, dy, dx
  const std::size_t pixels = tensor.camera.order.size();
  for (const BandLeaf& band : tensor.bands) {
    const float* at = band.values.data();
    for (int c = 0; c < tensor.channels; ++c)
      for (const BandOffset& offset : band_offsets(band.radius)) {
        planes.insert(planes.end(), {c, offset.dy, offset.dx});
        runs.add({at, pixels});
        at += pixels;
      }
  }
  packer.add("bandPlanes", planes);
  packer.add("bandHalves", runs.halves);
  packer.add("bandExponents", runs.exponents);
}

void pack_columns(Packer& packer, const PageTensor& tensor) {
  if (tensor.columns.empty()) return;
  std::vector<std::int32_t> ranges;
  for (const SparseColumn& column : tensor.columns)
    ranges.insert(ranges.end(), {column.col_begin, column.col_end, static_cast<std::int32_t>(column.first),
                                 static_cast<std::int32_t>(column.last)});
  const HalfRuns runs = by_channel(tensor.column_values, tensor.channels);
  packer.add("columns", ranges);
  packer.add("columnRows", tensor.column_rows);
  packer.add("columnHalves", runs.halves);
  packer.add("columnExponents", runs.exponents);
}

void pack_held_out(Packer& packer, std::span<const HeldOut> held_out) {
  if (held_out.empty()) return;
  HalfRuns patterns, photographs;
  for (const HeldOut& one : held_out) {
    patterns.add(one.pattern.values());
    photographs.add(one.photograph.values());
  }
  packer.add("patternHalves", patterns.halves);
  packer.add("patternExponents", patterns.exponents);
  packer.add("photographHalves", photographs.halves);
  packer.add("photographExponents", photographs.exponents);
}

}  // namespace

Pack pack_tensor(const PageTensor& tensor, std::span<const HeldOut> held_out) {
  Packer packer;
  packer.add("cameraOrder", tensor.camera.order);
  if (!tensor.symmetric) packer.add("projectorOrder", tensor.projector.order);
  if (!tensor.camera.areas.empty()) packer.add("cameraAreas", tensor.camera.areas);
  if (!tensor.projector.areas.empty()) packer.add("projectorAreas", tensor.projector.areas);
  pack_leaves(packer, tensor);
  if (!tensor.diagonal.empty()) packer.add("diagonal", tensor.diagonal);
  pack_entries(packer, tensor);
  pack_bands(packer, tensor);
  pack_columns(packer, tensor);
  pack_held_out(packer, held_out);
  return std::move(packer).take();
}

std::string base64_text(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t rest = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t bits = std::uint32_t{bytes[k]} << 16U;
    if (rest > 1) bits |= std::uint32_t{bytes[k + 1]} << 8U;
    if (rest > 2) bits |= bytes[k + 2];
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += digit <= rest ? kDigits[bits >> (18 - 6 * digit) & 63U] : '=';
  }
  return text;
}

}  // namespace symrig::viewer

namespace symrig {

namespace {

std::string kernel_base64() {
  const std::string_view module = viewer::kernel_module();
  return viewer::base64_text({reinterpret_cast<const std::uint8_t*>(module.data()), module.size()});
}

/// Nobody serves this page, so its nonce guards nothing that a reader of the file could not change.
constexpr std::string_view kExportNonce = "symrig";

/// A page of this tensor is larger. It saves the time to write pages that are far too large.
std::int64_t least_bytes(const viewer::PageTensor& tensor) {
  return (std::ssize(tensor.factors) + std::ssize(tensor.entry_values)) * std::int64_t{2} * 4 / 3;
}

std::string written(const StoredScene& scene, const std::string& title, const viewer::PageTensor& tensor,
                    bool reduced) {
  const std::span<const HeldOut> held_out(scene.held_out.data(), reduced ? 0 : scene.held_out.size());
  const viewer::Pack pack = viewer::pack_tensor(tensor, held_out);
  nlohmann::json facts = viewer::scene_facts(scene, title);
  facts["engine"] = "kernel";
  facts["sections"] = pack.sections;
  if (reduced) {
    facts["reducedFrom"] = facts["camera"];
    facts["camera"] = {tensor.camera.grid.rows, tensor.camera.grid.cols};
    facts["projector"] = {tensor.projector.grid.rows, tensor.projector.grid.cols};
    facts["heldOut"] = nlohmann::json::array();
  }
  const std::string kernel = kernel_base64(), bytes = viewer::base64_text(pack.bytes);
  return viewer::page_text({.facts = facts, .nonce = kExportNonce, .kernel = kernel, .pack = bytes});
}

}  // namespace

Result<ExportedPage> export_page(const StoredScene& scene, const ExportOptions& options) {
  SYMRIG_TRY(viewer::PageTensor tensor, viewer::page_tensor(scene.tensor));
  for (int levels = 0;; ++levels) {
    if (levels > 0) {
      auto reduced = viewer::reduced_tensor(scene.tensor, levels);
      if (!reduced)
        return Error{ErrorCode::limit,
                     fmt::format("the page takes more than {:.3g} MB, and {}",
                                 static_cast<double>(options.max_bytes) * 1e-6, reduced.error().what),
                     reduced.error().hint};
      tensor = *std::move(reduced);
    }
    if (least_bytes(tensor) > options.max_bytes) continue;
    std::string html = written(scene, options.title, tensor, levels > 0);
    if (std::ssize(html) <= options.max_bytes)
      return ExportedPage{std::move(html), tensor.camera.grid, tensor.projector.grid, levels > 0};
  }
}

}  // namespace symrig
