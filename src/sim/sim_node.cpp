// SPDX-License-Identifier: BSD-3-Clause
#include "sim/sim_node.h"

#include <algorithm>

#include "sim/gl.h"

namespace tld_follower::sim {
namespace {

const ros::WallDuration kIdle(0.01);   // How long a paused loop sleeps.
const ros::WallDuration kPoll(0.001);  // How long a waiting loop goes without serving services.
constexpr double kCatchUp = 0.1;       // Lateness up to this is made up for, more is let go [s].
constexpr int64_t kDiagnosticPeriod = 1000000000;  // Of simulated time [ns].
const ros::WallDuration kWarningPeriod(5.0);       // Of the same warning.

void Warn(const std::string& message) { ROS_WARN_STREAM(message); }

// Whether a warning last given at `last` may be given again now; if so, it counts as given.
bool IsDue(ros::WallTime* last) {
  const ros::WallTime now = ros::WallTime::now();
  if (now - *last < kWarningPeriod) return false;
  *last = now;
  return true;
}

// In lockstep all other nodes wait for the pictures, so their cores are free to draw: a pair is
// ready in 0.6 of the time, for a tenth more of CPU time.
NodeParameters Prepared(const NodeParameters& parameters) {
  if (parameters.mode == Mode::kLockstep) SetDrawingThreads(2);
  return parameters;
}

}  // namespace

SimNode::SimNode()
    : private_handle_("~"),
      parameters_(Prepared(ReadParameters(private_handle_))),
      simulation_(parameters_.simulation, Warn),
      publishers_(handle_, private_handle_, simulation_),
      diagnostics_(handle_, simulation_, parameters_.mode),
      paused_(parameters_.paused) {
  handle_.setCallbackQueue(&command_queue_);
  Subscribe("cmd_vel", &Simulation::vehicle, &vehicle_commands_);
  Subscribe(simulation_.cast().target().name + "/cmd_vel", &Simulation::target, &target_commands_);
  wind_ = handle_.subscribe("wind", 10, &SimNode::OnWind, this);
  pause_ = private_handle_.advertiseService("pause_physics", &SimNode::OnPause, this);
  unpause_ = private_handle_.advertiseService("unpause_physics", &SimNode::OnUnpause, this);
  reset_world_ = private_handle_.advertiseService("reset_world", &SimNode::OnResetWorld, this);
  reset_simulation_ =
      private_handle_.advertiseService("reset_simulation", &SimNode::OnResetSimulation, this);
  step_ = private_handle_.advertiseService("step", &SimNode::OnStep, this);
  publishers_.PublishStart(simulation_, Stamp());
  RestartTime();
  ROS_INFO("%s, %d triangles, %dx%d, %s", parameters_.simulation.world_file.c_str(),
           simulation_.triangles(), simulation_.camera().width, simulation_.camera().height,
           paused_ ? "paused" : "running");
}

void SimNode::Run() {
  ros::CallbackQueue& services = *ros::getGlobalCallbackQueue();
  while (ros::ok()) {
    services.callAvailable(paused_ ? kIdle : ros::WallDuration(0));
    command_queue_.callAvailable();
    if (paused_) continue;
    if (WaitsForCommands()) {
      command_queue_.callAvailable(kPoll);
      continue;
    }
    const double ahead = SecondsAhead();
    if (ahead > 0) {
      command_queue_.callAvailable(ros::WallDuration(std::min(ahead, kIdle.toSec())));
      continue;
    }
    Advance();
  }
}

ros::Time SimNode::Stamp() const {
  ros::Time stamp;
  stamp.fromNSec(uint64_t(start_ns_ + simulation_.time_ns()));
  return stamp;
}

void SimNode::Advance() {
  const Moment moment = simulation_.Advance();
  publishers_.Publish(&simulation_, moment, Stamp());
  if (simulation_.time_ns() % kDiagnosticPeriod == 0) {
    pace_.real_time_factor = publishers_.real_time_factor();
    diagnostics_.Publish(simulation_, pace_, Stamp());
  }
  if (moment.frame && parameters_.mode == Mode::kLockstep) {
    waiting_ = true;
    vehicle_commands_.came = target_commands_.came = false;
    frame_published_ = ros::WallTime::now();
  }
}

// The answer to a frame is one command for the vehicle and, if so asked, one for the target.
bool SimNode::WaitsForCommands() {
  if (!waiting_) return false;
  const Commands* missing = nullptr;
  if (parameters_.lockstep_target && !target_commands_.came) missing = &target_commands_;
  if (!vehicle_commands_.came) missing = &vehicle_commands_;
  if (missing == nullptr) {
    waiting_ = false;
  } else if ((ros::WallTime::now() - frame_published_).toSec() > parameters_.lockstep_timeout) {
    waiting_ = false;
    ++pace_.unanswered_frames;
    ROS_WARN(
        "lockstep: no %s answered frame %lu within %.1f s (%s); going on without. If it comes "
        "late, "
        "it answers a later frame: this run is no longer reproducible",
        missing->subscriber.getTopic().c_str(), static_cast<unsigned long>(simulation_.frame()),
        parameters_.lockstep_timeout,
        missing->subscriber.getNumPublishers() == 0 ? "nobody publishes it"
                                                    : "who publishes it is silent");
  }
  return waiting_;
}

// How long the wall clock has to catch up with the simulation [s]; moves the anchor where the
// simulation is late, since frames are never skipped to make up for it.
double SimNode::SecondsAhead() {
  if (parameters_.mode != Mode::kRealtime) return 0;
  const ros::WallTime now = ros::WallTime::now();
  const double ahead = (simulation_.time() - anchor_time_) - (now - anchor_wall_).toSec();
  if (ahead > -kCatchUp) return ahead;
  anchor_time_ = simulation_.time();
  anchor_wall_ = now;
  ++pace_.late_frames;
  pace_.lost_time -= ahead;
  if (IsDue(&slip_warning_)) {
    ROS_WARN("slower than real time: %.0f ms late, real-time factor %.2f", -1e3 * ahead,
             publishers_.real_time_factor());
  }
  return 0;
}

void SimNode::RestartTime() {
  anchor_time_ = simulation_.time();
  anchor_wall_ = frame_published_ = ros::WallTime::now();
  publishers_.RestartStopwatch();
}

void SimNode::Subscribe(const std::string& topic, MobileRobot& (Simulation::*robot)(),
                        Commands* commands) {
  commands->subscriber = handle_.subscribe<geometry_msgs::Twist>(
      topic, 10,
      [this, robot, commands](const geometry_msgs::TwistConstPtr& twist) {
        OnCommand(*twist, &(simulation_.*robot)(), commands);
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

void SimNode::OnCommand(const geometry_msgs::Twist& twist, MobileRobot* robot, Commands* commands) {
  commands->came = true;
  const bool finite = robot->Command({twist.linear.x, twist.linear.y, twist.linear.z},
                                     twist.angular.z, simulation_.time());
  if (!finite && IsDue(&commands->warning)) {
    ROS_WARN("%s is not finite; %s", commands->subscriber.getTopic().c_str(),
             robot->flies() ? "hovering" : "stopping");
  }
}

void SimNode::OnWind(const geometry_msgs::Vector3& wind) {
  const btVector3 velocity{btScalar(wind.x), btScalar(wind.y), btScalar(wind.z)};
  if (!simulation_.SetWind(velocity) && IsDue(&wind_warning_)) {
    ROS_WARN("%s is not finite or no wind that is survived; it stays as it was",
             wind_.getTopic().c_str());
  }
}

bool SimNode::OnPause(Empty::Request&, Empty::Response&) {
  paused_ = true;
  return true;
}

bool SimNode::OnUnpause(Empty::Request&, Empty::Response&) {
  if (paused_) RestartTime();
  paused_ = false;
  return true;
}

bool SimNode::OnResetWorld(Empty::Request&, Empty::Response&) {
  Reset(start_ns_ + simulation_.time_ns());
  return true;
}

bool SimNode::OnResetSimulation(Empty::Request&, Empty::Response&) {
  Reset(0);
  return true;
}

void SimNode::Reset(int64_t start_ns) {
  simulation_.Reset();
  start_ns_ = start_ns;
  waiting_ = false;
  publishers_.PublishClock(Stamp());
  publishers_.PublishStart(simulation_, Stamp());
  RestartTime();
}

bool SimNode::OnStep(tld_follower::Step::Request& request, tld_follower::Step::Response& response) {
  response.stamp = Stamp();
  if (!paused_) {
    response.message = "the simulation is running; call pause_physics first";
    return true;
  }
  RestartTime();
  const uint64_t last = simulation_.frame() + request.frames;
  while (ros::ok() && simulation_.frame() < last) {
    command_queue_.callAvailable(waiting_ ? kPoll : ros::WallDuration(0));
    if (!WaitsForCommands()) Advance();
  }
  response.success = simulation_.frame() == last;
  response.stamp = Stamp();
  return true;
}

}  // namespace tld_follower::sim

int main(int argc, char** argv) {
  ros::init(argc, argv, "gazebo");
  ros::start();  // Or the end of the node's last handle would silence the message below.
  try {
    tld_follower::sim::SimNode().Run();
  } catch (const std::exception& problem) {
    ROS_FATAL("%s", problem.what());
    return 1;
  }
  return 0;
}
