// SPDX-License-Identifier: BSD-3-Clause
#include "sim/resources.h"

#include <filesystem>
#include <utility>

namespace tld_follower::sim {

namespace fs = std::filesystem;

Resources::Resources(std::vector<std::string> directories) : directories_(std::move(directories)) {}

Resources Resources::ForWorld(const std::string& world_file) {
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  const fs::path prefix = executable.parent_path().parent_path().parent_path();
  return Resources({fs::absolute(world_file, error).parent_path().string(),
                    (prefix / "share" / "tld_follower" / "worlds").string()});
}

std::string Resources::Find(const std::string& uri) const {
  std::string path = uri;
  for (const std::string prefix : {"package://tld_follower/worlds/", "model://", "file://"}) {
    if (path.compare(0, prefix.size(), prefix) == 0) {
      path.erase(0, prefix.size());
      break;
    }
  }
  std::error_code error;
  for (const std::string& directory : directories_) {
    const fs::path candidate = fs::path(directory) / path;  // An absolute path replaces directory.
    if (fs::is_regular_file(candidate, error)) return candidate.string();
  }
  return {};
}

}  // namespace tld_follower::sim
