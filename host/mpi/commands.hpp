// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program.hpp"
#include "rig.hpp"

namespace symrig::mpi {

/// Deals a scene over the ranks. fails: as DealtTransport::open; bad_argument (memory for several ranks: each
/// holds its share).
Result<apps::OpenedScene> open_dealt(const std::string& path, const LoadOptions& options);

/// `symrig-mpi`. prepare: called before a job.
apps::Program mpi_program(void (*prepare)());

/// Its commands.
apps::Job add_relight(CLI::App& command);
apps::Job add_evaluate(CLI::App& command);
apps::Job add_solve(CLI::App& command);
apps::Job add_polish(CLI::App& command);

}  // namespace symrig::mpi
