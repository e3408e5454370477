// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/parameters_node.h"

#include <ros/console.h>

#include <sstream>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

using XmlRpc::XmlRpcValue;

[[noreturn]] void Fail(const std::string& name, const std::string& what) {
  throw std::invalid_argument("parameter ~" + name + " must be " + what);
}

// `type` is what T is called in XML-RPC: roscpp itself takes a fraction as a whole number.
template <typename T>
T Read(const ros::NodeHandle& handle, const std::string& name, const std::string& what,
       XmlRpcValue::Type type, const T& fallback) {
  XmlRpcValue value;
  if (!handle.getParam(name, value)) return fallback;
  if (value.getType() != type) Fail(name, what);
  return static_cast<T&>(value);
}

bool IsNumber(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeInt || value.getType() == XmlRpcValue::TypeDouble;
}

double ToNumber(XmlRpcValue value) {
  return value.getType() == XmlRpcValue::TypeInt ? static_cast<int&>(value)
                                                 : static_cast<double&>(value);
}

bool AreEqual(const XmlRpcValue& a, const XmlRpcValue& b) {
  return IsNumber(a) && IsNumber(b) ? ToNumber(a) == ToNumber(b) : a == b;
}

void CheckTransport(const std::string& name, const image_transport::ImageTransport& transport) {
  const std::string plugins = "image_transport/";
  std::string names;
  for (const std::string& plugin : transport.getLoadableTransports()) {
    if (plugin == plugins + name) return;
    names += (names.empty() ? "" : ", ") + plugin.substr(plugins.size());
  }
  Fail("image_transport",
       "one of the transports installed here (" + names + "), not '" + name + "'");
}

}  // namespace

InputParameters ReadInputParameters(const ros::NodeHandle& private_handle,
                                    const image_transport::ImageTransport& transport) {
  InputParameters parameters;
  const std::string whole = "a whole number, 1 or more";
  parameters.queue_size =
      Read(private_handle, "queue_size", whole, XmlRpcValue::TypeInt, parameters.queue_size);
  if (parameters.queue_size < 1) Fail("queue_size", whole);
  parameters.approximate_sync = Read(private_handle, "approximate_sync", "true or false",
                                     XmlRpcValue::TypeBoolean, parameters.approximate_sync);
  parameters.image_transport =
      Read(private_handle, "image_transport", "the name of an image transport",
           XmlRpcValue::TypeString, parameters.image_transport);
  CheckTransport(parameters.image_transport, transport);
  return parameters;
}

ParameterValues ReadValues(const ros::NodeHandle& handle, const std::vector<std::string>& names) {
  ParameterValues values;
  for (const auto& name : names) {
    XmlRpcValue value;
    if (handle.getParam(name, value)) values[name] = value;
  }
  return values;
}

void WarnOfChanges(const ros::NodeHandle& handle, const ParameterValues& asked) {
  std::ostringstream changes;
  for (const auto& [name, value] : asked) {
    XmlRpcValue in_force;
    handle.getParam(name, in_force);
    if (AreEqual(value, in_force)) continue;
    changes << (changes.tellp() > 0 ? ", " : "") << "~" << name << " " << in_force << " for "
            << value;
  }
  if (changes.tellp() > 0) {
    ROS_WARN_STREAM("parameters out of range or of a wrong type; in force are " << changes.str());
  }
}

}  // namespace tld_follower::stereo
