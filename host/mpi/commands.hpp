// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "opened_scene.hpp"

namespace symrig::mpi {

/// Deals a scene over the ranks. fails: as DealtTransport::open; bad_argument (memory for several ranks: each
/// holds its share).
Result<apps::OpenedScene> open_dealt(const std::string& path, const LoadOptions& options);

/// The commands of `symrig-mpi`.
apps::Job add_relight(CLI::App& command);
apps::Job add_evaluate(CLI::App& command);
apps::Job add_solve(CLI::App& command);

}  // namespace symrig::mpi
