// SPDX-License-Identifier: BSD-3-Clause
#include "sim/spiri.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

constexpr double kMaxHeadingError = 0.3;   // Heading and altitude that are held never run away
constexpr double kMaxAltitudeError = 0.3;  // from the drone by more than this [rad, m].
constexpr double kStillSpeed = 0.1;        // Slower than this, the place is held [m/s].
constexpr double kAirDensity = 1.225;      // At sea level [kg/m^3].
constexpr double kGroundEffectReach = 5;   // Above so many rotor radii it is 0.3 % and left out.
constexpr double kStanding = 0.3;          // The rotors stop so long after the landing [s].
constexpr double kTakenOff = 0.02;  // Take-off ends so near its altitude [m], this slow [m/s].

double Wrap(double angle) { return std::remainder(angle, 2 * M_PI); }

btVector3 ClipHorizontal(const btVector3& v, double limit) {
  const double norm = std::hypot(v.x(), v.y());
  const btScalar scale = norm > limit ? btScalar(limit / norm) : btScalar(1);
  return {v.x() * scale, v.y() * scale, v.z()};
}

// Scaled down to the limit before anything is squared: a command may be as large as 1e300.
btVector3 ClipVelocity(const std::array<double, 3>& v, double max_xy, double max_z) {
  const double norm = std::hypot(v[0], v[1]);
  const double scale = norm > max_xy ? max_xy / norm : 1.0;
  return {btScalar(v[0] * scale), btScalar(v[1] * scale),
          btScalar(std::clamp(v[2], -max_z, max_z))};
}

// Rotors in the order front left, rear left, rear right, front right; neighbours turn opposite.
constexpr std::array<double, 4> kAlongX{1, -1, -1, 1};
constexpr std::array<double, 4> kAlongY{1, 1, -1, -1};
constexpr std::array<double, 4> kSpin{-1, 1, -1, 1};

}  // namespace

double Heading(const btMatrix3x3& attitude) { return std::atan2(attitude[1][0], attitude[0][0]); }

Spiri::Spiri(const SpiriParameters& parameters, const Robot& robot, const btTransform& pose,
             Physics* physics)
    : parameters_(parameters), physics_(physics), start_(pose), battery_(parameters.battery) {
  std::vector<const RobotLink*> rigid;
  for (const RobotLink& link : robot.links) rigid.push_back(&link);
  parts_.push_back({physics->AddBody(rigid, pose), rigid});
  mass_ = 1.0 / body().rigid->getInvMass();
  inertia_ = body().rigid->getLocalInertia();
  gravity_ = body().rigid->getGravity().length();
  altitude_ = pose.getOrigin().z();
  heading_ = Heading(pose.getBasis());
  hold_ = pose.getOrigin();
  const double max_thrust =
      4 * parameters.motor_constant * parameters.max_rotor_speed * parameters.max_rotor_speed;
  if (!(max_thrust > mass_ * gravity_)) {
    throw std::runtime_error("spiri's rotors cannot lift it: " + std::to_string(max_thrust) +
                             " N at full speed, weight " + std::to_string(mass_ * gravity_) + " N");
  }
  if (altitude_ > parameters.take_off_altitude - kTakenOff) {  // It starts in the air.
    flying_ = true;
    rotor_speeds_.fill(std::sqrt(mass_ * gravity_ / 4 / parameters.motor_constant));
  }
}

bool Spiri::Command(const std::array<double, 3>& velocity, double yaw_rate, double time) {
  const auto finite = [](double v) { return std::isfinite(v); };
  if (!std::all_of(velocity.begin(), velocity.end(), finite) || !finite(yaw_rate)) {
    command_.reset();
    return false;
  }
  const double max_yaw = parameters_.max_yaw_rate;
  Setpoint setpoint;
  setpoint.velocity = ClipVelocity(velocity, parameters_.max_speed_xy, parameters_.max_speed_z);
  setpoint.yaw_rate = std::clamp(yaw_rate, -max_yaw, max_yaw);
  setpoint.time = time;
  command_ = setpoint;
  return true;
}

btVector3 Spiri::WantedVelocity(double time) {
  if (command_ && time - command_->time > parameters_.command_timeout) command_.reset();
  const btTransform pose = body().Pose();
  const btVector3& place = pose.getOrigin();
  const btVector3 speed = body().Velocity();
  const double target = parameters_.take_off_altitude;

  btVector3 wanted(0, 0, 0);
  if (!flying_) {
    // The altitude that is held climbs at the take-off speed.
    altitude_ = std::min(altitude_ + parameters_.take_off_speed * Physics::kStep, target);
    flying_ = std::abs(place.z() - target) < kTakenOff && std::abs(speed.z()) < kTakenOff;
  }
  if (landing_) {
    Land(place, speed);
  } else if (flying_ && command_) {
    const btMatrix3x3 yaw(btQuaternion(btVector3(0, 0, 1), btScalar(Heading(pose.getBasis()))));
    wanted = yaw * command_->velocity;
    altitude_ += command_->velocity.z() * Physics::kStep;
    heading_ += command_->yaw_rate * Physics::kStep;
    hold_.reset();
  } else if (!hold_ && std::hypot(speed.x(), speed.y()) < kStillSpeed) {
    hold_ = place;
  }
  if (hold_) {
    wanted = btScalar(parameters_.position_p) * (*hold_ - place);
    wanted.setZ(0);
    wanted = ClipHorizontal(wanted, parameters_.take_off_speed);
  }
  altitude_ =
      std::clamp<double>(altitude_, place.z() - kMaxAltitudeError, place.z() + kMaxAltitudeError);
  wanted.setZ(wanted.z() + btScalar(parameters_.position_p * (altitude_ - place.z())));
  return wanted;
}

// Sinks where it is; when it has pushed down for a while and does not sink any more, it stands.
void Spiri::Land(const btVector3& place, const btVector3& speed) {
  if (!hold_) hold_ = place;
  altitude_ -= parameters_.take_off_speed * Physics::kStep;
  const bool stands =
      altitude_ < place.z() - 0.8 * kMaxAltitudeError && std::abs(speed.z()) < kTakenOff;
  standing_ = stands ? standing_ + Physics::kStep : 0.0;
  landed_ = landed_ || standing_ > kStanding;
}

btVector3 Spiri::WantedForce(const btVector3& wanted_velocity) {
  const btVector3 error = wanted_velocity - body().Velocity();
  const btVector3 p(btScalar(parameters_.velocity_xy_p), btScalar(parameters_.velocity_xy_p),
                    btScalar(parameters_.velocity_z_p));
  const btVector3 i(btScalar(parameters_.velocity_xy_i), btScalar(parameters_.velocity_xy_i),
                    btScalar(parameters_.velocity_z_i));
  // The drag at the wanted speed is known, so the integrator need not find it while the error is
  // still large: that would overshoot.
  const double speed = std::hypot(wanted_velocity.x(), wanted_velocity.y());
  const btScalar against_drag = btScalar(parameters_.drag_xy * speed / mass_);
  const btVector3 acceleration =
      p * error + integral_ + against_drag * btVector3(wanted_velocity.x(), wanted_velocity.y(), 0);
  const double lift = std::max(0.3 * gravity_, gravity_ + acceleration.z());
  const double limit = lift * std::tan(parameters_.max_tilt);
  const bool saturated = std::hypot(acceleration.x(), acceleration.y()) > limit;
  // The integrator rests while the tilt is at its limit, or it would wind up.
  const btScalar dt = btScalar(Physics::kStep);
  if (!saturated) integral_ += dt * btVector3(i.x() * error.x(), i.y() * error.y(), 0);
  integral_.setZ(integral_.z() + dt * i.z() * error.z());
  const btVector3 level = ClipHorizontal(acceleration, limit);
  return btScalar(mass_) * btVector3(level.x(), level.y(), btScalar(lift));
}

btVector3 Spiri::WantedTorque(const btVector3& wanted_force, double wanted_yaw_rate) const {
  const btMatrix3x3& attitude = body().rigid->getWorldTransform().getBasis();
  const btVector3 rates = attitude.transpose() * body().AngularVelocity();
  // The shortest turn from the rotors' axis to the wanted force, in body axes; it has no z part.
  const btVector3 wanted_up = attitude.transpose() * wanted_force.normalized();
  const btVector3 axis = btVector3(0, 0, 1).cross(wanted_up);
  const double sine = axis.length();
  const double angle = std::atan2(sine, wanted_up.z());
  const btVector3 tilt_error = sine > 1e-6 ? axis * btScalar(angle / sine) : axis;
  const btVector3 acceleration(
      btScalar(parameters_.attitude_p * tilt_error.x() - parameters_.attitude_d * rates.x()),
      btScalar(parameters_.attitude_p * tilt_error.y() - parameters_.attitude_d * rates.y()),
      btScalar(parameters_.yaw_rate_p * (wanted_yaw_rate - rates.z())));
  return inertia_ * acceleration;
}

void Spiri::DriveRotors(double thrust, const btVector3& torque) {
  const double lever = parameters_.arm / std::sqrt(2.0);
  const double fastest = parameters_.max_rotor_speed;
  for (size_t r = 0; r < rotor_speeds_.size(); ++r) {
    const double wanted = thrust / 4 + kAlongY[r] * torque.x() / (4 * lever) -
                          kAlongX[r] * torque.y() / (4 * lever) +
                          kSpin[r] * torque.z() / (4 * parameters_.moment_constant);
    const double speed =
        std::clamp(std::sqrt(std::max(0.0, wanted) / parameters_.motor_constant), 0.0, fastest);
    const double lag =
        speed > rotor_speeds_[r] ? parameters_.time_constant_up : parameters_.time_constant_down;
    rotor_speeds_[r] += (speed - rotor_speeds_[r]) * (1 - std::exp(-Physics::kStep / lag));
  }
}

double Spiri::GroundEffect() const {
  const double radius = parameters_.rotor_radius;
  const double range = kGroundEffectReach * radius;
  const btTransform pose = body().Pose();
  const double height =
      physics_->CastRay(pose.getOrigin(), -pose.getBasis().getColumn(2), range, body().rigid);
  if (height >= range) return 1;
  const double ratio = radius / (4 * std::max(height, radius / 2));
  return 1 / (1 - ratio * ratio);
}

// Momentum theory: a rotor of area A that pushes with T takes at least T^1.5 / sqrt(2 rho A).
double Spiri::Power() const {
  const double area = M_PI * parameters_.rotor_radius * parameters_.rotor_radius;
  double ideal = 0;
  for (const double speed : rotor_speeds_) {
    const double thrust = parameters_.motor_constant * speed * speed;
    ideal += thrust * std::sqrt(thrust / (2 * kAirDensity * area));
  }
  return parameters_.electronics_power + ideal / parameters_.rotor_efficiency;
}

void Spiri::ApplyForces() {
  const double lever = parameters_.arm / std::sqrt(2.0);
  const double ground_effect = GroundEffect();
  btVector3 force(0, 0, 0), torque(0, 0, 0);
  for (size_t r = 0; r < rotor_speeds_.size(); ++r) {
    const double thrust =
        ground_effect * parameters_.motor_constant * rotor_speeds_[r] * rotor_speeds_[r];
    force += btVector3(0, 0, btScalar(thrust));
    torque +=
        btVector3(btScalar(kAlongY[r] * lever * thrust), btScalar(-kAlongX[r] * lever * thrust),
                  btScalar(kSpin[r] * parameters_.moment_constant * thrust));
  }
  const btMatrix3x3& attitude = body().rigid->getWorldTransform().getBasis();
  const btVector3 air = attitude.transpose() * (body().Velocity() - physics_->wind());
  const btVector3 rates = attitude.transpose() * body().AngularVelocity();
  const btVector3 drag(btScalar(parameters_.drag_xy), btScalar(parameters_.drag_xy),
                       btScalar(parameters_.drag_z));
  const btVector3 turn_drag(btScalar(parameters_.drag_roll_pitch),
                            btScalar(parameters_.drag_roll_pitch), btScalar(parameters_.drag_yaw));
  force -= air.length() * drag * air;
  torque -= rates.length() * turn_drag * rates;
  body().rigid->applyCentralForce(attitude * force);
  body().rigid->applyTorque(attitude * torque);
}

OdometrySample Spiri::Odometry() const {
  const btTransform pose = body().Pose();
  const btMatrix3x3 to_body = pose.getBasis().transpose();
  return {start_.inverse() * pose, to_body * body().Velocity(), to_body * body().AngularVelocity()};
}

void Spiri::Actuate(double time) {
  const btVector3 wanted_velocity = WantedVelocity(time);
  const double heading = Heading(body().Pose().getBasis());
  const double heading_error =
      std::clamp(Wrap(heading_ - heading), -kMaxHeadingError, kMaxHeadingError);
  heading_ = heading + heading_error;
  const double yaw_rate =
      (ready() && command_ ? command_->yaw_rate : 0.0) + parameters_.heading_p * heading_error;

  const btVector3 force = WantedForce(wanted_velocity);
  const btVector3 up = body().rigid->getWorldTransform().getBasis().getColumn(2);
  if (landed_ || battery_.charge() <= 0) {
    DriveRotors(0, btVector3(0, 0, 0));
  } else {
    DriveRotors(std::max<double>(0, force.dot(up)), WantedTorque(force, yaw_rate));
  }
  battery_.Drain(Power(), Physics::kStep);
  landing_ = landing_ || battery_.charge() <= parameters_.reserve;
  ApplyForces();
}

}  // namespace tld_follower::sim
