"""The stepper model by itself, case by case; each asserts and prints its name."""

import bare_board
import cases

# isort: split
from math import cos, exp, pi, sin, sqrt

from arm import motors
from arm.stepper import Noise, Stepper

# all cases: not emulated
MS = 84_000
MODEL = {
    "holding_torque_nm": 0.65,
    "rotor_inertia_kg_m2": 8.2e-6,
    "inertia_kg_m2": 0.15,
    "damping_nm_s": 0.18,
    "corner_speed_rad_s": 0.0,
    "gravity_torque_nm": 0.0,
    "backlash_deg": 0.0,
    "encoder_phase_counts": 0.5,
    "scatter_deg": 0.0,
}
MICROSTEPS = 32
STEPS_PER_DEG = 200 * MICROSTEPS * 2 / 360
INERTIA = 0.15 / 4 + 8.2e-6
CYCLE = 4 * MICROSTEPS  # microsteps in which the torque angle repeats


class Line:
    """A pin: STEP, DIR or an always active ENABLE."""

    def __init__(self, level=0):
        self.level = level
        self.sinks = []

    def on(self):
        return True


class Encoder:
    """Counts what it is turned by."""

    counts = 0

    def turn(self, counts):
        self.counts += counts


def stepper(seed=1, on_motor=False, **changed):
    """A motor with the paper's first joint after it, and its DIR line and encoder."""
    joint = {
        "dir_inverted": 0,
        "encoder_inverted": 0,
        "counts_num": 5,
        "counts_den": 16,
        "start_deg": 0.0,
        "steps_per_deg": STEPS_PER_DEG,
        "gear_ratio": 2.0,
        "microsteps": MICROSTEPS,
        "model": dict(MODEL, **changed),
        "encoder_on_motor": on_motor,
    }
    direction, encoder = Line(1), Encoder()
    motor = Stepper(Line(), direction, Line(), encoder, joint, seed)
    motor.begin(0)
    return motor, direction, encoder


def steps(motor, times):
    """STEP pulses that rise at the given ticks."""
    edges = []
    for time in times:
        edges.extend((time, time + 100))
    motor.edges(None, 0, len(edges), edges, 0)


def run(motor, first_ms, last_ms):
    """Where the rotor is at the end of each millisecond."""
    places = []
    for ms in range(first_ms, last_ms):
        if motor.moved:
            motor.follow((ms + 1) * MS)
        places.append(motor._x)
    return places


def case_rings_like_a_damped_pendulum():
    """Four microsteps at once; the closed form is that of a mass on a spring and a damper that both jump."""
    motor, _, _ = stepper()
    steps(motor, [0, 0, 0, 0])
    natural = sqrt(0.65 * 50 / INERTIA)
    damping = 0.18 / (2 * INERTIA * natural)
    damped = natural * sqrt(1 - damping**2)
    for index, place in enumerate(run(motor, 0, 1000)):
        t = (index + 1) / 1000
        swing = cos(damped * t) - damping / sqrt(1 - damping**2) * sin(damped * t)
        exact = 4 * (1 - exp(-damping * natural * t) * swing)
        assert abs(place - exact) < 0.05, (index, place, exact)


def case_comes_to_rest_on_the_command():
    motor, direction, encoder = stepper()
    steps(motor, [MS * number for number in range(400)])
    run(motor, 0, 4000)
    assert not motor.moved
    assert motor._x == 400
    assert encoder.counts == 125
    direction.level = 0
    steps(motor, [4000 * MS + MS * number for number in range(400)])
    run(motor, 4000, 8000)
    assert motor._x == 0
    assert encoder.counts == 0


def case_lags_by_what_acceleration_asks():
    """Constant acceleration: the lag's torque is inertia times acceleration."""
    motor, _, _ = stepper(damping_nm_s=1.5)
    rate = 4000.0  # microsteps/s²
    steps(motor, [int(sqrt(2 * (number + 0.5) / rate) * 1000 * MS) for number in range(2000)])
    places = run(motor, 0, 800)
    t = 0.8
    lag = rate * t * t / 2 - places[-1]
    torque = INERTIA * rate * 2 * pi / (200 * MICROSTEPS)
    assert abs(0.65 * sin(2 * pi * lag / CYCLE) - torque) < 0.03 * torque, (lag, torque)


def case_slips_when_driven_too_hard():
    motor, _, _ = stepper()
    steps(motor, [number * 1000 for number in range(3200)])  # 84 000 microsteps/s from rest
    run(motor, 0, 4000)
    assert not motor.moved
    lost = 3200 - motor._x
    assert lost >= CYCLE
    assert abs(lost / CYCLE - round(lost / CYCLE)) < 1e-9


def case_torque_falls_with_speed():
    """What the motor follows with all its torque, it loses if the torque falls with speed."""
    lags = []
    for corner in (0.0, 3.0):
        motor, _, _ = stepper(corner_speed_rad_s=corner, inertia_kg_m2=0.02)
        rate = 60_000.0
        steps(motor, [int(sqrt(2 * (number + 0.5) / rate) * 1000 * MS) for number in range(12_000)])
        lags.append(rate * 0.63**2 / 2 - run(motor, 0, 630)[-1])
    assert 0 < lags[0] < CYCLE / 4
    assert lags[1] > CYCLE


def case_gravity_makes_it_sag():
    motor, _, _ = stepper(gravity_torque_nm=0.5)
    sag = -motor._x
    assert abs(0.65 * sin(2 * pi * sag / CYCLE) - 0.25) < 1e-3


def case_backlash_is_lost_at_a_reversal():
    motor, direction, _ = stepper(backlash_deg=0.9, damping_nm_s=20.0)
    steps(motor, [MS * number for number in range(320)])
    run(motor, 0, 3000)
    up = motor.angle_deg()
    direction.level = 0
    steps(motor, [3000 * MS + MS * number for number in range(320)])
    run(motor, 3000, 6000)
    assert abs(up - (320 / STEPS_PER_DEG - 0.45)) < 0.03
    assert abs(motor.angle_deg() - 0.45) < 0.03


def case_an_encoder_on_the_motor_sees_no_backlash():
    for on_motor, lost in ((False, 0.45), (True, 0.0)):
        motor, _, encoder = stepper(on_motor=on_motor, backlash_deg=0.9, damping_nm_s=20.0)
        steps(motor, [MS * number for number in range(320)])
        run(motor, 0, 3000)
        assert abs(encoder.counts - (320 - lost * STEPS_PER_DEG) * 5 / 16) < 2, (on_motor, encoder.counts)


def case_scatter_differs_between_motions_and_repeats_with_the_seed():
    ends = []
    for seed in (5, 5, 6):
        motor, direction, _ = stepper(seed, scatter_deg=0.1)
        now = 0
        found = []
        for _ in range(4):
            motor.begin(now)
            direction.level = 1 - direction.level
            steps(motor, [now + MS * number for number in range(400)])
            run(motor, now // MS, now // MS + 4000)
            now += 4000 * MS
            assert not motor.moved
            found.append(round(1000 * (motor._x - motor.position)))
        ends.append(found)
    assert ends[0] == ends[1]
    assert ends[0] != ends[2]
    assert len(set(ends[0])) == 4


def case_blocked_joint_stands_still():
    motor, _, encoder = stepper()
    motor.blocked = True
    steps(motor, [MS * number for number in range(50)])
    run(motor, 0, 20)
    assert motor.moved and motor._v == 0
    run(motor, 20, 1000)
    assert motor._x == 0
    assert encoder.counts == 0


class Wired:
    """The board program's table of pins."""

    LIMIT = ("PD8", "PD9")


def case_limit_switches_trip_at_and_beyond_their_angles():
    board = bare_board.start()
    motor = Line()
    joint = {"limit_low": 0, "low_deg": -8.0, "limit_high": 1, "high_deg": 30.0, "limit_active_high": 1}
    found = motors.limit_switches(motor, joint, Wired)
    for angle_deg, levels in ((-9.0, [1, 0]), (-8.0, [1, 0]), (-7.9, [0, 0]), (29.9, [0, 0]), (30.0, [0, 1])):
        motor.angle_deg = lambda angle_deg=angle_deg: angle_deg
        for switch in found:
            switch.look()
        assert [board.pins.line(name).read() for name in Wired.LIMIT] == levels, angle_deg


def case_noise_is_normal():
    noise = Noise(7)
    values = [noise.normal() for _ in range(3000)]
    mean = sum(values) / len(values)
    spread = sqrt(sum([(value - mean) ** 2 for value in values]) / len(values))
    assert abs(mean) < 0.06
    assert abs(spread - 1) < 0.05


bare_board.start()
cases.run(globals())
