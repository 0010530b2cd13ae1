// SPDX-License-Identifier: Apache-2.0
#include "viewer/page_text.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig::viewer {
namespace {

nlohmann::json size_of(Grid grid) {
  return {grid.rows, grid.cols};
}

/// JSON inside a <script> element: '<' would let a title end the element.
std::string script_json(const nlohmann::json& value) {
  const std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::string safe;
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

}  // namespace

nlohmann::json scene_facts(const StoredScene& scene, std::string_view title) {
  const TransportTensor& tensor = scene.tensor;
  const ViewLayout views = tensor.camera_tree().views();
  nlohmann::json names = nlohmann::json::array();
  for (const HeldOut& one : scene.held_out) names.push_back(one.name);
  nlohmann::json facts{{"title", title},
                       {"camera", size_of(tensor.camera_grid())},
                       {"projector", size_of(tensor.projector_grid())},
                       {"channels", tensor.channels()},
                       {"symmetric", tensor.symmetric()},
                       {"views", {views.rows, views.cols}},
                       {"levels", tensor.levels()},
                       {"heldOut", std::move(names)}};
  if (scene.camera || scene.camera_left_out) facts["pixels"] = "cells";
  return facts;
}

/// Views tile the cells, not these pixels.
void add_camera_facts(nlohmann::json& facts, const CameraView& camera) {
  facts["pixels"] = "camera";
  facts["camera"] = size_of(camera.camera().camera_grid());
  facts["channels"] = camera.channels();
  facts["symmetric"] = false;
  facts["views"] = {1, 1};
  if (const auto quick = camera.quick_grid()) facts["quick"] = size_of(*quick);
}

std::string page_text(const PageParts& parts) {
  const std::string facts = script_json(parts.facts);
  const std::string policy = content_policy(parts.nonce, parts.pack.empty());
  const std::array<std::pair<std::string_view, std::string_view>, 5> marks{{{"@POLICY@", policy},
                                                                            {"@NONCE@", parts.nonce},
                                                                            {"@SCENE@", facts},
                                                                            {"@KERNEL@", parts.kernel},
                                                                            {"@PACK@", parts.pack}}};
  std::string text;
  const std::string_view page = page_template();
  text.reserve(page.size() + facts.size() + parts.kernel.size() + parts.pack.size() + 1024);
  for (std::size_t at = 0; at < page.size();) {
    const std::size_t next = page.find('@', at);
    text += page.substr(at, next - at);
    if (next == std::string_view::npos) break;
    at = next + 1;
    std::string_view value = "@";
    for (const auto& [mark, with] : marks)
      if (page.substr(next, mark.size()) == mark) {
        value = with;
        at = next + mark.size();
      }
    text += value;
  }
  return text;
}

std::string content_policy(std::string_view nonce, bool server) {
  return fmt::format(
      "default-src 'none'; script-src 'nonce-{0}' 'wasm-unsafe-eval'; style-src 'nonce-{0}'; "
      "img-src blob: data:; connect-src {1}; form-action 'none'; base-uri 'none'",
      nonce, server ? "'self'" : "'none'");
}

}  // namespace symrig::viewer
