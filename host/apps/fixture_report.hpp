// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/fixture_test.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// "OUT:IN,OUT:IN" of --plug. Empty: none.
/// fails: bad_argument.
Result<std::vector<Jumper>> plug_of(const std::string& text);

/// A line for each check of the plug.
std::string fixture_text(const FixtureTest& test);
/// What the plug showed, for the results file: wires, crossing, trip, watchdog.
nlohmann::ordered_json fixture_json(const BoardInfo& info, const FixtureTest& test);
/// BOARD-SERIAL-20261124T160000Z.json. made: "2026-11-24T16:00:00Z".
std::filesystem::path results_name(const BoardInfo& info, std::string made);
/// The first check that failed, as a device error. OK: all passed.
Result<void> fixture_verdict(const FixtureTest& test);

}  // namespace symrig::apps
