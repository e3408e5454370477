// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace tld_follower::sim {

/// Finds the files that worlds and robots name.
class Resources {
 public:
  /// `directories` are searched in this order.
  explicit Resources(std::vector<std::string> directories);

  /// Searches the folder of `world_file`, then the generated media beside the running executable
  /// (PREFIX/lib/PACKAGE/executable -> PREFIX/share/PACKAGE/worlds), in develspace and installed.
  static Resources ForWorld(const std::string& world_file);

  /// Path of `uri`, or an empty string. Understood: absolute and relative paths, file://PATH,
  /// model://PATH and package://tld_follower/worlds/PATH.
  std::string Find(const std::string& uri) const;

 private:
  std::vector<std::string> directories_;
};

}  // namespace tld_follower::sim
