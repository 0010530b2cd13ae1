// SPDX-License-Identifier: Apache-2.0
#include "viewer/live_service.hpp"

#include "viewer/light_code.hpp"
#include "viewer/page_text.hpp"
#include "viewer/replies.hpp"

#include <utility>

namespace symrig::viewer {
namespace {

template <class T>
nlohmann::json or_null(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

nlohmann::json levels_json(const std::vector<LiveLevel>& levels) {
  nlohmann::json list = nlohmann::json::array();
  for (const LiveLevel& one : levels)
    list.push_back({{"level", one.level},
                    {"photographs", one.photographs},
                    {"error", or_null(one.error)},
                    {"halfWidth", or_null(one.half_width)}});
  return list;
}

nlohmann::json live_json(const LiveScene::Now& now, double seconds) {
  const LiveStatus& status = *now.status;
  return {{"complete", now.scene != nullptr},
          {"failed", now.failure ? nlohmann::json(*now.failure) : nlohmann::json()},
          {"stage", status.stage},
          {"done", status.done},
          {"expected", status.expected},
          {"steps", status.steps.done},
          {"stepsExpected", status.steps.expected},
          {"computing", status.computing},
          {"frames", status.frames},
          {"rigSeconds", status.rig_seconds},
          {"seconds", seconds},
          {"toGo", or_null(status.to_go)},
          {"lostFrames", status.lost_frames},
          {"trouble", status.trouble},
          {"levels", levels_json(*now.levels)},
          {"tensor", now.tensors},
          {"photograph", now.photographs}};
}

ViewReply not_yet() {
  return refusal(404, "The capture has no picture yet.");
}

}  // namespace

LiveService::LiveService(std::shared_ptr<const LiveScene> scene, ViewOptions options, std::string secret,
                         std::string nonce)
    : scene_(std::move(scene)),
      options_(std::move(options)),
      secret_(std::move(secret)),
      nonce_(std::move(nonce)),
      gate_(secret_) {}

std::uint64_t LiveService::max_body() const {
  return most_light_bytes(scene_->grid());
}

ViewReply LiveService::answer(const ViewRequest& request) {
  if (auto refusal = gate_.refused_or_odd(request)) return *std::move(refusal);
  const LiveScene::Now now = scene_->now();
  const std::string_view what = gate_.asked(request);
  if (what == "live" && !request.post()) {
    scene_->asked(now.failure != nullptr);
    return json_reply(live_json(now, scene_->seconds()));
  }
  if (now.scene) return finished(request, now);
  ViewReply reply;
  one_thread_.execute([&] {
    if (!request.post()) {
      reply = got(what, now);
    } else if (what == "relight" || what == "dual") {
      const TransportTensor* const known = tensor(now);
      reply = known != nullptr ? relit_reply(request.body, *known, what == "dual") : not_yet();
    } else {
      reply = nothing_here();
    }
  });
  return reply;
}

/// The tensor so far; nullptr: there is none yet.
const TransportTensor* LiveService::tensor(const LiveScene::Now& now) {
  if (now.tensors > made_ && now.make) {
    tensor_ = (*now.make)();
    made_ = now.tensors;
  }
  return tensor_ ? &*tensor_ : nullptr;
}

ViewReply LiveService::got(std::string_view what, const LiveScene::Now& now) {
  if (what.empty()) return page_reply(first_facts(), nonce_);
  if (what == "last") return now.last ? photograph_reply(now.last->pattern, now.last->photograph) : not_yet();
  if (what == "relight" || what == "dual") return refusal(405, "Use POST.");
  if (what != "facts" && what != "leaves") return nothing_here();
  const TransportTensor* const known = tensor(now);
  if (known == nullptr) return not_yet();
  return what == "facts" ? json_reply(facts(*known)) : leaves_reply(*known);
}

/// What is known before the first photograph.
nlohmann::json LiveService::first_facts() const {
  const nlohmann::json size{scene_->grid().rows, scene_->grid().cols};
  return {{"title", options_.title},        {"live", true},     {"camera", size}, {"projector", size},
          {"channels", scene_->channels()}, {"symmetric", true}};
}

nlohmann::json LiveService::facts(const TransportTensor& tensor) const {
  nlohmann::json facts = scene_facts({.tensor = tensor, .capture_json = {}, .held_out = {}}, options_.title);
  facts["engine"] = "server";
  facts["truth"] = false;
  facts["packed"] = false;
  facts["live"] = true;
  return facts;
}

ViewReply LiveService::finished(const ViewRequest& request, const LiveScene::Now& now) {
  if (!finished_) {
    ViewOptions options = options_;
    options.truth = *now.truth;
    finished_ = std::make_unique<ViewService>(*now.scene, std::move(options), secret_, nonce_);
    tensor_.reset();
  }
  return finished_->answer(request);
}

}  // namespace symrig::viewer
