// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <functional>
#include <memory>
#include <string>

namespace symrig::apps {

/// A scene that a command works with.
struct OpenedScene {
  StoredScene scene;                                   ///< its tensor may be only a share of T
  std::shared_ptr<const TransportOperator> transport;  ///< all of T
};

/// Opens a scene file. `symrig` reads it into its process; `symrig-mpi` deals it over several.
using OpenScene = std::function<Result<OpenedScene>(const std::string& path, const LoadOptions& options)>;

/// fails: as load_scene.
Result<OpenedScene> open_here(const std::string& path, const LoadOptions& options);

/// The commands that only apply T, with scenes from `open`.
Job add_relight_of(CLI::App& command, OpenScene open);
Job add_evaluate_of(CLI::App& command, OpenScene open);

}  // namespace symrig::apps
