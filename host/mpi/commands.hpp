// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "opened_scene.hpp"

namespace symrig::mpi {

/// Deals a scene over the ranks. fails: as DealtTransport::open.
Result<apps::OpenedScene> open_dealt(const std::string& path);

/// The commands of `symrig-mpi`.
apps::Job add_relight(CLI::App& command);
apps::Job add_evaluate(CLI::App& command);
apps::Job add_solve(CLI::App& command);

}  // namespace symrig::mpi
