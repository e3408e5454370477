// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/cast.h"
#include "sim/exposure.h"
#include "sim/image_noise.h"
#include "sim/physics.h"
#include "sim/renderer.h"
#include "sim/sensors.h"
#include "sim/world.h"

namespace tld_follower::sim {

/// What a camera does to its pictures beyond noise; config/simulator.yaml.
struct CameraEffects {
  bool shadow_map = false;      ///< Shadows fall on everything, not on the ground alone.
  double exposure_change = 0;   ///< Standard deviation of a wandering gain [stops].
  double exposure_time = 2.0;   ///< Its correlation time [s].
  int blur_pictures = 1;        ///< Pictures that one is averaged of; 1 for no motion blur.
  double shutter_time = 0.008;  ///< In which they are taken, the last one at the stamp [s].
};

struct SimulationConfig {
  std::string world_file;
  uint64_t seed = 0;
  double frame_rate = 30;    ///< Stereo pairs a second of simulated time [Hz].
  double image_noise = 1.0;  ///< Standard deviation [grey levels].
  StereoCamera camera;       ///< A ground vehicle carries it on its mast instead.
  CastConfig cast;
  CameraEffects effects;
  SensorParameters sensors;
};

/// What only a simulator knows. World frame, SI units.
struct Truth {
  double distance = 0;  ///< Left camera's centre to the nearest point of the target.
  /// Vehicle's collision shape to the nearest point of anything else; but ground for one that
  /// rolls.
  double clearance = 0;
  uint32_t collisions = 0;  ///< Contact episodes of the vehicle since it was ready; likewise.
};

/// What happened at the moment to which the simulation advanced.
struct Moment {
  bool tick = false;       ///< 100 Hz: clock, IMU, odometry.
  bool slow_tick = false;  ///< 50 Hz: joint states and wheel odometry.
  bool frame = false;      ///< A stereo pair is due.
};

/// The whole simulation: world, vehicle, target and cameras. Knows no ROS and no wall clock.
///
/// Frame k = 1, 2, ... falls on the physics step nearest to k / frame_rate. The same configuration
/// and the same commands at the same times give bit-identical states and images, in a fresh object
/// as after Reset().
class Simulation {
 public:
  /// Throws std::exception with one readable sentence if the configuration cannot be simulated.
  Simulation(const SimulationConfig& config, const WarningSink& warn);
  ~Simulation();

  /// Back to the start: rebuilds the world.
  void Reset();

  /// Steps the physics to the next moment at which something is due.
  Moment Advance();

  /// Since the start or the last reset.
  int64_t time_ns() const;
  double time() const { return double(time_ns()) * 1e-9; }
  uint64_t frame() const { return frame_; }  ///< Number of the latest frame; 0 before the first.

  /// Velocity of the air until the next reset, world axes [m/s]; calm at first. Returns false for
  /// one that is not finite or blows faster than a hurricane, 40 m/s, which changes nothing.
  bool SetWind(const btVector3& wind);

  /// Draws the stereo pair of this moment; also finds the target's pixels unless `mask` is null.
  void Render(StereoImages* images, TargetMask* mask);
  /// Of the left picture that was drawn last: depth [m] and labels (renderer.h).
  void ReadDepth(std::vector<float>* depth) { renderer_->ReadDepth(depth); }
  void ReadLabels(std::vector<uint8_t>* labels) { renderer_->ReadLabels(labels); }
  /// Computes the truth of this moment.
  Truth Measure() const;

  /// Valid until the next reset.
  MobileRobot& vehicle();
  MobileRobot& target();
  const MobileRobot& vehicle() const;
  const MobileRobot& target() const;
  const Cast& cast() const { return cast_; }
  const Sensors& sensors() const;
  /// Reads the range finder [m]; infinity if nothing is in range.
  double ReadRange();
  const StereoCamera& camera() const { return camera_; }
  int triangles() const { return renderer_->triangles(); }

 private:
  struct State;

  Scene MakeScene() const;
  void Draw(double before, StereoImages* images, TargetMask* mask);
  int64_t FrameStep(uint64_t frame) const;
  void CountContacts();

  const SimulationConfig config_;
  const Resources resources_;
  const World world_;
  const Cast cast_;
  const StereoCamera camera_;
  ImageNoise image_noise_;
  Blur blur_;
  std::unique_ptr<State> state_;
  std::unique_ptr<Renderer> renderer_;
  int64_t step_ = 0;
  uint64_t frame_ = 0;
};

}  // namespace tld_follower::sim
