"""Brushless motor with its speed controller, and the servos."""

import math

from vehicle_model.compiled import compiled

__all__ = ["electrical_power", "motor_current", "motor_torque", "servo_rate", "throttle_for"]


@compiled
def motor_current(rotor, throttle: float, speed: float) -> float:
    """Motor current [A] of a ROTOR record, signed like the torque it makes, at a rotor speed [rad/s].

    Direct-current equivalent: V = I R + K w. Where `throttle_sets_power` the controller regulates the electrical
    power V I to throttle * max_power, within the battery's voltage and its own current limit; otherwise it sets V to
    throttle * battery_voltage (and brakes when the motor turns faster than that).
    """
    throttle = min(max(throttle, rotor.min_throttle), 1.0)
    emf = speed * rotor.torque_constant
    if rotor.throttle_sets_power == 0:
        current = (throttle * rotor.battery_voltage - emf) / rotor.resistance
        return min(max(current, -rotor.max_current), rotor.max_current)
    if throttle == 0.0:
        return 0.0
    direction = math.copysign(1.0, throttle)
    emf *= direction
    power = abs(throttle) * rotor.max_power
    current = 2.0 * power / (emf + math.sqrt(emf * emf + 4.0 * rotor.resistance * power))
    if current * rotor.resistance + emf > rotor.battery_voltage:
        current = (rotor.battery_voltage - emf) / rotor.resistance
    return direction * max(min(current, rotor.max_current), 0.0)


@compiled
def friction_current(rotor, speed: float) -> float:
    """Current [A] that friction takes: the no-load current, fading below 1 rad/s so that it has no jump at rest."""
    return rotor.no_load_current * min(max(speed, -1.0), 1.0)


@compiled
def motor_torque(rotor, current: float, speed: float) -> float:
    """Torque on the shaft [N m]: the torque constant K = 1/Kv times the current, less no-load friction."""
    return (current - friction_current(rotor, speed)) * rotor.torque_constant


@compiled
def electrical_power(rotor, current: float, speed: float) -> float:
    """Power a motor takes from the battery [W]: V I with V = I R + K w, negative when it brakes and gives some back."""
    return (current * rotor.resistance + speed * rotor.torque_constant) * current


@compiled
def throttle_for(rotor, speed: float, torque: float) -> float:
    """Throttle that holds a rotor speed [rad/s] against a shaft torque [N m]; the inverse of the two above.

    Beyond +-1 the motor cannot hold it. Where throttle sets power, a torque that drives the motor gives 0.
    """
    current = torque / rotor.torque_constant + friction_current(rotor, speed)
    voltage = current * rotor.resistance + speed * rotor.torque_constant
    if rotor.throttle_sets_power == 0:
        return voltage / rotor.battery_voltage
    if current * speed <= 0.0:
        return 0.0
    return math.copysign(voltage * current / rotor.max_power, current)


@compiled
def servo_rate(servo, position: float, command: float) -> float:
    """Rate of a servo [rad/s]: first-order lag to the command inside its travel, rate limited."""
    target = min(max(command, servo.minimum), servo.maximum)
    rate = (target - position) / servo.time_constant
    return min(max(rate, -servo.rate_limit), servo.rate_limit)
