// SPDX-License-Identifier: Apache-2.0
#include "symrig/viewer/page.hpp"
#include "viewer/pack.hpp"
#include "viewer/page_bytes.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

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
