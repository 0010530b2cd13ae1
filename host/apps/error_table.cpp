// SPDX-License-Identifier: Apache-2.0
#include "error_table.hpp"

#include "console.hpp"

#include <fmt/format.h>

namespace symrig::apps {

std::string error_table(const TransportErrors& e) {
  return fmt::format(
      "  frobenius        {:>10}   all of T\n"
      "  indirect         {:>10}   without the direct light\n"
      "  flood            {:>10}   all projector pixels on\n"
      "  relight bar      {:>10}   a vertical bar\n"
      "  relight random   {:>10}   a random pattern\n"
      "  relight natural  {:>10}   a smooth picture\n"
      "  bar_indirect     {:>10}   the bar, seen only outside it\n",
      percent(e.frobenius), percent(e.indirect), percent(e.flood), percent(e.relight_bar),
      percent(e.relight_random), percent(e.relight_natural), percent(e.bar_indirect));
}

}  // namespace symrig::apps
