// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_service.hpp"

#include "viewer/light_code.hpp"
#include "viewer/pack.hpp"
#include "viewer/page_bytes.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"
#include "viewer/replies.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

namespace symrig::viewer {
namespace {

ViewReply bytes_reply(std::string bytes) {
  return {.type = "application/octet-stream", .body = std::move(bytes)};
}

}  // namespace

ViewService::ViewService(StoredScene scene, ViewOptions options, const std::string& secret, std::string nonce)
    : scene_(std::move(scene)), options_(std::move(options)), gate_(secret), nonce_(std::move(nonce)) {
  if (scene_.tensor.bytes() > options_.max_local_bytes) return;
  // Without a pack, the page asks the server for each picture.
  const Result<PageTensor> page = page_tensor(scene_.tensor);
  if (!page) return;
  Pack pack = pack_tensor(*page, scene_.held_out);
  pack_.assign(pack.bytes.begin(), pack.bytes.end());
  sections_ = std::move(pack.sections);
}

std::uint64_t ViewService::max_body() const {
  return std::max(most_light_bytes(scene_.tensor.camera_grid()),
                  most_light_bytes(scene_.tensor.projector_grid()));
}

ViewReply ViewService::answer(const ViewRequest& request) {
  if (auto refusal = gate_.refused_or_odd(request)) return *std::move(refusal);
  const std::string_view what = gate_.asked(request);
  return request.post() ? posted(what, request.body) : got(what);
}

ViewReply ViewService::posted(std::string_view what, std::string_view light) const {
  if (what == "relight" || what == "dual") return relit_reply(light, scene_.tensor, what == "dual");
  if (what == "truth" && options_.truth)
    return picture_reply(light, scene_.tensor.projector_grid(), options_.truth);
  return nothing_here();
}

ViewReply ViewService::got(std::string_view what) const {
  constexpr std::string_view kHeldOut = "held-out/";
  if (what.empty()) return page_reply(facts(), nonce_);
  if (what == "facts") return json_reply(facts());
  if (what == "leaves") return leaves_reply(scene_.tensor);
  if (what == "kernel") return bytes_reply(std::string(kernel_module()));
  if (what == "pack" && !pack_.empty()) return bytes_reply(pack_);
  if (what.substr(0, kHeldOut.size()) == kHeldOut) return held_out(what.substr(kHeldOut.size()));
  if (what == "relight" || what == "dual" || (what == "truth" && options_.truth))
    return refusal(405, "Use POST.");
  return nothing_here();
}

nlohmann::json ViewService::facts() const {
  nlohmann::json facts = scene_facts(scene_, options_.title);
  facts["engine"] = "server";
  facts["truth"] = static_cast<bool>(options_.truth);
  facts["packed"] = !pack_.empty();
  facts["sections"] = sections_;
  return facts;
}

ViewReply ViewService::held_out(std::string_view number) const {
  std::size_t k = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), k);
  if (error != std::errc{} || end != number.data() + number.size() || k >= scene_.held_out.size())
    return refusal(404, "There is no held-out photograph of this number.");
  return photograph_reply(scene_.held_out[k].pattern, scene_.held_out[k].photograph);
}

}  // namespace symrig::viewer
