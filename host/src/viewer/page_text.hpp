// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/file.hpp"
#include "viewer/camera_view.hpp"

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::viewer {

// What host/viewer/bundle.py makes of host/viewer at build time.
/// The page: HTML with its style and script, and @MARKS@ for what differs (page_text.cpp).
std::string_view page_template();
/// The kernel: a WebAssembly module (host/viewer/kernel).
std::string_view kernel_module();

/// What the page's script must know of a scene: title, grids, channels, views, names of held-out photographs.
nlohmann::json scene_facts(const StoredScene& scene, std::string_view title);
/// Makes them those of a page that shows the camera's own pixels.
void add_camera_facts(nlohmann::json& facts, const CameraView& camera);

/// What differs between two pages.
struct PageParts {
  nlohmann::json facts;
  std::string_view nonce;        ///< a word that only this page's style and script carry
  std::string_view kernel = {};  ///< base64, of an exported page
  std::string_view pack = {};    ///< base64, of an exported page
};
/// The whole page.
std::string page_text(const PageParts& parts);

/// The policy of the page: it may run its own script and style, and load nothing but from its own address.
/// server: may it talk to its server?
std::string content_policy(std::string_view nonce, bool server);

}  // namespace symrig::viewer
