#!/usr/bin/env python3
"""An arm for the device lab, in Python without packages: a simulated hand that pushes and returns.

    python3 docs/examples/lab_arm.py --push 0 -20 0 --wait &
    touchstone run hello --device lab:5005

Replace read_pose() and apply_wrench() by your arm's. docs/devices.md has the datagrams as tables.
"""
import argparse
import math
import random
import socket
import struct
import time

POSE = struct.Struct("<4sHHIIQQ3d4d")    # magic, version, flags, session, buttons, sequence, time, position, quaternion
WRENCH = struct.Struct("<4sHHIIQQ3d3d")  # magic, version, state, session, 0, sequence, time, force, torque
ENGAGED = 1
PERIOD = 0.001        # s
SILENCE = 0.020       # s without a wrench, after which the arm gives no force
SPRING = 0.5          # N/mm: the hand holds the arm, which is light
FOLLOW = 0.05         # share of the way to the balance of forces that the arm moves in a period


class Arm:
    """The simulated arm. All values are in mm, N and mN·m; x right, y up, z toward the user."""

    def __init__(self, push, seconds):
        self.push, self.seconds = push, seconds
        self.position, self.force = [0.0] * 3, [0.0] * 3

    def read_pose(self, t):
        """Position and unit quaternion x, y, z, w at t seconds. The hand goes out and back."""
        share = 0.5 * (1 - math.cos(2 * math.pi * min(t / self.seconds, 1)))
        for i in range(3):
            balance = share * self.push[i] + self.force[i] / SPRING
            self.position[i] += FOLLOW * (balance - self.position[i])
        return self.position, (0.0, 0.0, 0.0, 1.0)

    def apply_wrench(self, force, torque):
        """Drives the motors. `torque` turns about the position; this arm has no motors for it."""
        self.force = list(force)


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--address", default="127.0.0.1", help="where touchstone listens")
    options.add_argument("--port", type=int, default=5005)
    options.add_argument("--push", type=float, nargs=3, default=(0, -20, 0), metavar=("X", "Y", "Z"), help="mm")
    options.add_argument("--seconds", type=float, default=8, help="duration of the motion, after which the arm stops")
    options.add_argument("--wait", action="store_true", help="begin when the device is engaged")
    options = options.parse_args()

    arm = Arm(options.push, options.seconds)
    peer = (options.address, options.port)
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.setblocking(False)
    session, sequence = random.getrandbits(32), 0
    start = last_wrench = time.monotonic()
    strongest, answered, state = [0.0] * 3, 0, 0
    waiting = options.wait
    while True:
        now = time.monotonic()
        if waiting:
            start = now
        if now - start > options.seconds:
            break
        position, quaternion = arm.read_pose(now - start)
        sequence += 1
        link.sendto(POSE.pack(b"TSLP", 1, 0, session, 0, sequence, time.monotonic_ns(), *position, *quaternion), peer)
        time.sleep(PERIOD)
        while True:
            try:
                data, sender = link.recvfrom(2048)
            except BlockingIOError:
                break
            # Only wrenches for this session, of the protocol's version, from the place that gets the poses.
            if sender != peer or len(data) != WRENCH.size:
                continue
            magic, version, state, of, _, _, _, *wrench = WRENCH.unpack(data)
            if magic != b"TSLW" or version != 1 or of != session:
                continue
            last_wrench, answered = time.monotonic(), answered + 1
            engaged = state == ENGAGED and all(map(math.isfinite, wrench))
            waiting = waiting and not engaged
            arm.apply_wrench(*((wrench[:3], wrench[3:]) if engaged else ([0.0] * 3, [0.0] * 3)))
        if time.monotonic() - last_wrench > SILENCE:
            arm.apply_wrench([0.0] * 3, [0.0] * 3)
        if math.hypot(*arm.force) > math.hypot(*strongest):
            strongest = list(arm.force)
    print(f"{sequence} poses sent, {answered} wrenches received, state {state}, "
          f"largest force {strongest[0]:.3f} {strongest[1]:.3f} {strongest[2]:.3f} N")


if __name__ == "__main__":
    main()
