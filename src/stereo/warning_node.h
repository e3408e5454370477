// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/console.h>

#include <chrono>
#include <string>

namespace tld_follower::stereo {

/// Warnings of what may go wrong with every frame: the same text is said at most every 10 s.
class Warner {
 public:
  void operator()(const std::string& text) {
    const auto now = std::chrono::steady_clock::now();
    if (text == last_ && now - last_time_ < std::chrono::seconds(10)) return;
    last_ = text;
    last_time_ = now;
    ROS_WARN_STREAM(text);
  }

 private:
  std::string last_;
  std::chrono::steady_clock::time_point last_time_;
};

}  // namespace tld_follower::stereo
