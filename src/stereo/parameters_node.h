// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the stereo node: those that are read once, and those of dynamic_reconfigure.
#pragma once

#include <dynamic_reconfigure/server.h>
#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace tld_follower::stereo {

struct InputParameters {
  int queue_size = 5;             ///< Messages of each topic that wait for their partners.
  bool approximate_sync = false;  ///< Pairs by the nearest stamps, not by identical ones.
  std::string image_transport = "raw";
};

/// Throws std::invalid_argument naming the parameter if one has a wrong type or value.
InputParameters ReadInputParameters(const ros::NodeHandle& private_handle,
                                    const image_transport::ImageTransport& transport);

using ParameterValues = std::map<std::string, XmlRpc::XmlRpcValue>;

/// Those of the named parameters that are set.
ParameterValues ReadValues(const ros::NodeHandle& handle, const std::vector<std::string>& names);

/// Warns once of all parameters that are not in force as they were `asked` for.
void WarnOfChanges(const ros::NodeHandle& handle, const ParameterValues& asked);

/// Starts the server of a configuration; `changed` is called at once and with every change, and may
/// correct the values. The server silently puts what is in force in the place of values that are
/// out of range or of a wrong type; here whoever set them is told.
template <typename Config>
std::unique_ptr<dynamic_reconfigure::Server<Config>> StartReconfigure(
    const ros::NodeHandle& handle, const std::function<void(Config*)>& changed) {
  std::vector<std::string> names;
  for (const auto& description : Config::__getParamDescriptions__()) {
    names.push_back(description->name);
  }
  const ParameterValues asked = ReadValues(handle, names);
  auto server = std::make_unique<dynamic_reconfigure::Server<Config>>(handle);
  server->setCallback([changed](Config& config, uint32_t) { changed(&config); });
  WarnOfChanges(handle, asked);
  return server;
}

}  // namespace tld_follower::stereo
