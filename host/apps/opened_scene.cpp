// SPDX-License-Identifier: Apache-2.0
#include "opened_scene.hpp"

#include <utility>

namespace symrig::apps {

Result<OpenedScene> open_here(const std::string& path, const LoadOptions& options) {
  SYMRIG_TRY(StoredScene scene, load_scene(path, options));
  auto transport = std::make_shared<const TransportTensor>(scene.tensor);
  return OpenedScene{std::move(scene), std::move(transport)};
}

}  // namespace symrig::apps
