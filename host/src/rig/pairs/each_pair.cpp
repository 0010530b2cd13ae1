// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/each_pair.hpp"

#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::rig {

Error of_pair(std::size_t pair, Error error) {
  error.what = fmt::format("pair {}: {}", pair + 1, error.what);
  return error;
}

Result<void> for_each_pair(std::size_t pairs, const std::function<Result<void>(std::size_t)>& each) {
  std::vector<Result<void>> done(pairs);
  {
    std::vector<std::jthread> others;
    others.reserve(pairs);
    for (std::size_t k = 1; k < pairs; ++k) others.emplace_back([&done, &each, k] { done[k] = each(k); });
    if (pairs > 0) done[0] = each(0);
  }
  for (std::size_t k = 0; k < pairs; ++k)
    if (!done[k]) return of_pair(k, done[k].error());
  return {};
}

}  // namespace symrig::rig
