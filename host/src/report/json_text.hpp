// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/made.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

/// What all `--json` files share. Keys stay in the order in which they are set.
namespace symrig::report {

using Json = nlohmann::ordered_json;

/// Indented, ends with a newline. NaN and infinity have no place in JSON: they become null.
std::string json_text(const Json& json);
Json grid_json(Grid grid);
/// {rank1, lowrank, empty, scalar}, one number a level each.
Json leaves_json(const TransportTensor& tensor);

/// Adds `date`, `version` and `command_line`; those that are known.
void add_made(Json& json, const Made& made);

/// One object a photograph: name, rms, mean_white, relative, lit_pixels.
Json held_out_json(const std::vector<HeldOutError>& all);

}  // namespace symrig::report
