// SPDX-License-Identifier: Apache-2.0
// Reads a page of ours as a browser would, and says what a browser, a reader or a keyboard would stumble
// over.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::test {

struct Tag {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;  ///< all text inside, with entities as they are

  std::string get(const std::string& key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? std::string() : found->second;
  }
};

/// The tags of a page in the order in which they open. Tags that do not nest are a failure.
class PageReader {
 public:
  explicit PageReader(std::string html) : html_(std::move(html)) {
    while (at_ < html_.size()) html_[at_] == '<' ? read_tag() : read_text();
    EXPECT_TRUE(open_.empty()) << "not closed: " << tags_[open_.empty() ? 0 : open_.back()].name;
  }
  const std::vector<Tag>& tags() const { return tags_; }
  std::vector<Tag> named(const std::string& name) const {
    std::vector<Tag> found;
    std::copy_if(tags_.begin(), tags_.end(), std::back_inserter(found),
                 [&](const Tag& tag) { return tag.name == name; });
    return found;
  }

 private:
  void read_text() {
    const std::size_t end = std::min(html_.find('<', at_), html_.size());
    for (const std::size_t k : open_) tags_[k].text += html_.substr(at_, end - at_);
    at_ = end;
  }
  void read_tag() {
    const std::size_t end = html_.find('>', at_);
    ASSERT_NE(end, std::string::npos);
    const std::string inside = html_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    if (inside.starts_with("!")) return;
    if (inside.starts_with("/")) return close(inside.substr(1));
    Tag tag = tag_of(inside);
    const bool alone =
        inside.ends_with("/") || std::set<std::string>{"meta", "img", "wbr", "br"}.contains(tag.name);
    tags_.push_back(std::move(tag));
    if (!alone) open_.push_back(tags_.size() - 1);
    if (tags_.back().name == "style") at_ = html_.find("</style", at_);
  }
  void close(const std::string& name) {
    ASSERT_FALSE(open_.empty()) << "</" << name << ">";
    EXPECT_EQ(tags_[open_.back()].name, name) << "at " << html_.substr(at_ > 80 ? at_ - 80 : 0, 80);
    open_.pop_back();
  }
  static Tag tag_of(const std::string& inside) {
    Tag tag;
    std::size_t at = inside.find_first_of(" \n/");
    tag.name = inside.substr(0, at);
    while (at < inside.size()) {
      const std::size_t begin = inside.find_first_not_of(" \n/", at);
      const std::size_t equals = inside.find('=', at);
      if (begin == std::string::npos || equals == std::string::npos) break;
      const std::size_t close_quote = inside.find('"', equals + 2);
      tag.attributes[inside.substr(begin, equals - begin)] =
          inside.substr(equals + 2, close_quote - equals - 2);
      at = close_quote + 1;
    }
    return tag;
  }

  std::string html_;
  std::size_t at_ = 0;
  std::vector<Tag> tags_;
  std::vector<std::size_t> open_;
};

/// Nothing is loaded, nothing runs.
inline void expect_alone(const Tag& tag) {
  for (const char* name : {"script", "link", "iframe", "object", "embed", "form"}) EXPECT_NE(tag.name, name);
  for (const auto& [key, value] : tag.attributes) {
    EXPECT_FALSE(key.starts_with("on")) << key;
    const bool address = key == "href" || key == "src";
    const bool inside = value.starts_with("#") || value.starts_with("data:");
    EXPECT_TRUE(address
                    ? inside
                    : value.find("http:") == std::string::npos && value.find("https:") == std::string::npos)
        << key << ": " << value.substr(0, 60);
  }
}

/// Pictures have words, heads of tables have a direction, what can be saved has a name.
inline void expect_heard(const Tag& tag) {
  const bool saves = tag.name == "a" && tag.get("href").starts_with("data:");
  EXPECT_TRUE(!saves || !tag.get("download").empty());
  EXPECT_TRUE(tag.name != "img" || !tag.get("alt").empty());
  EXPECT_TRUE(tag.name != "th" || !tag.get("scope").empty());
  const bool named =
      tag.get("role") == "img" ? !tag.get("aria-label").empty() : tag.get("aria-hidden") == "true";
  EXPECT_TRUE(tag.name != "svg" || named);
}

inline void expect_numbers(const Tag& tag) {
  for (const char* key :
       {"x", "y", "x1", "x2", "y1", "y2", "cx", "cy", "r", "width", "height", "d", "points", "value"})
    for (const char* word : {"nan", "inf"}) EXPECT_EQ(tag.get(key).find(word), std::string::npos) << tag.name;
}

/// One h1, and no level is left out on the way down.
inline void expect_headings(const PageReader& page) {
  char level = '0';
  for (const Tag& tag : page.tags()) {
    if (tag.name.size() != 2 || tag.name[0] != 'h' || tag.name[1] < '1' || tag.name[1] > '6') continue;
    EXPECT_LE(tag.name[1], level + 1) << tag.text;
    level = tag.name[1];
  }
  EXPECT_EQ(page.named("h1").size(), 1U);
}

/// Ids stand once, and links to them arrive.
inline void expect_targets(const PageReader& page) {
  std::set<std::string> ids, targets;
  for (const Tag& tag : page.tags()) {
    const std::string id = tag.get("id");
    EXPECT_TRUE(id.empty() || ids.insert(id).second) << id;
    if (tag.get("href").starts_with("#")) targets.insert(tag.get("href").substr(1));
  }
  for (const std::string& target : targets) EXPECT_TRUE(ids.contains(target)) << target;
}

/// Works without network and script, by keyboard and by ear.
inline void expect_sound(const PageReader& page) {
  for (const Tag& tag : page.tags()) {
    expect_alone(tag);
    expect_heard(tag);
    expect_numbers(tag);
  }
  expect_headings(page);
  expect_targets(page);
}

}  // namespace symrig::test
