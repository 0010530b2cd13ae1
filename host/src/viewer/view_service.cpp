// SPDX-License-Identifier: Apache-2.0

#include "viewer/view_service.hpp"

#include "symrig/viewer/live.hpp"
#include "viewer/pack.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"
#include "viewer/service.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

namespace symrig::viewer {

namespace {

ViewReply bytes_reply(std::string bytes) {
  return {.type = "application/octet-stream", .body = std::move(bytes)};
}

/// A number of an address; nothing if it is no number from 0 to below `end`.
std::optional<std::size_t> number_below(std::int64_t end, std::string_view text) {
  std::size_t k = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), k);
  const bool good = error == std::errc{} && rest == text.data() + text.size() && std::cmp_less(k, end);
  return good ? std::optional(k) : std::nullopt;
}

}  // namespace

ViewService::ViewService(StoredScene scene, ViewOptions options, const std::string& secret, std::string nonce)
    : scene_(std::move(scene)), options_(std::move(options)), gate_(secret), nonce_(std::move(nonce)) {
  if (scene_.camera) camera_ = CameraView::make(scene_.camera);
  if (camera_ || scene_.tensor.bytes() > options_.max_local_bytes) return;
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
  if (camera_ && what == "relight")
    return picture_reply(light, scene_.tensor.projector_grid(),
                         [&](const Image<float>& one) { return camera_->relit(one); });
  if (camera_ && camera_->quick_grid() && what == "quick")
    return picture_reply(light, scene_.tensor.projector_grid(),
                         [&](const Image<float>& one) { return camera_->relit_quickly(one); });
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
  return camera_ ? of_camera(what) : nothing_here();
}

ViewReply ViewService::of_camera(std::string_view what) const {
  constexpr std::string_view kSees = "sees/";
  if (what == "places") return places_reply(cell_places(camera_->camera()));
  if (what == "quick" && camera_->quick_grid()) return refusal(405, "Use POST.");
  if (what.substr(0, kSees.size()) != kSees) return nothing_here();
  const auto pixel = number_below(camera_->camera().camera_grid().size(), what.substr(kSees.size()));
  if (!pixel) return refusal(404, "There is no pixel of this number.");
  const auto seen = camera_->seen_by(static_cast<std::int32_t>(*pixel));
  return seen ? planes_reply(*seen) : refusal(500, seen.error().line());
}

nlohmann::json ViewService::facts() const {
  nlohmann::json facts = scene_facts(scene_, options_.title);
  facts["engine"] = "server";
  facts["truth"] = static_cast<bool>(options_.truth);
  facts["packed"] = !pack_.empty();
  facts["sections"] = sections_;
  if (camera_) add_camera_facts(facts, *camera_);
  return facts;
}

ViewReply ViewService::held_out(std::string_view number) const {
  const auto k = number_below(std::ssize(scene_.held_out), number);
  if (!k) return refusal(404, "There is no held-out photograph of this number.");
  return photograph_reply(scene_.held_out[*k].pattern, scene_.held_out[*k].photograph);
}

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

// What a part replaces is destroyed after the lock is released.

namespace symrig {

void LiveScene::show(LiveStatus status) {
  auto fresh = std::make_shared<const LiveStatus>(std::move(status));
  const std::lock_guard lock(mutex_);
  now_.status.swap(fresh);
}

void LiveScene::show(LivePhotograph last) {
  auto fresh = std::make_shared<const LivePhotograph>(std::move(last));
  const std::lock_guard lock(mutex_);
  now_.last.swap(fresh);
  ++now_.photographs;
}

void LiveScene::show(const std::optional<LiveLevel>& level, MakeTensor make) {
  auto fresh = std::make_shared<const MakeTensor>(std::move(make));
  std::vector<LiveLevel> all = *now().levels;
  if (level) all.push_back(*level);
  auto levels = std::make_shared<const std::vector<LiveLevel>>(std::move(all));
  const std::lock_guard lock(mutex_);
  now_.make.swap(fresh);
  now_.levels.swap(levels);
  ++now_.tensors;
}

void LiveScene::complete(StoredScene scene, Truth truth) {
  auto whole = std::make_shared<const StoredScene>(std::move(scene));
  auto known = std::make_shared<const Truth>(std::move(truth));
  std::shared_ptr<const MakeTensor> last;
  const std::lock_guard lock(mutex_);
  now_.scene.swap(whole);
  now_.truth.swap(known);
  now_.make.swap(last);
}

void LiveScene::fail(std::string reason) {
  auto why = std::make_shared<const std::string>(std::move(reason));
  const std::lock_guard lock(mutex_);
  now_.failure.swap(why);
}

void LiveScene::asked(bool told) const {
  last_asked_ = steady_now().count();
  if (told) told_ = true;
}

bool LiveScene::watched_within(Nanoseconds time) const {
  const std::int64_t last = last_asked_;
  return last != kNever && steady_now().count() - last <= time.count();
}

LiveScene::Now LiveScene::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

}  // namespace symrig
