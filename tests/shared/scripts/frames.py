"""Prints the frames that the board's reader finds in a file: frames.py STREAM."""

import sys
from binascii import hexlify


class Time:
    now_ms = 0

    def ticks_diff(end, start):
        return end - start


sys.modules["time"] = Time

from armtempo_board.link.frame_reader import FrameReader  # noqa: E402


class Stream:
    def __init__(self, data):
        self.data = data

    def readinto(self, buffer, count):
        piece = self.data[:count]
        self.data = self.data[count:]
        buffer[: len(piece)] = piece
        return len(piece) or None


with open(sys.argv[1], "rb") as file:
    stream = Stream(file.read())
reader = FrameReader()
idle = 0
while idle < 2000:
    if reader.poll(stream, Time.now_ms):
        data = reader.data
        print(data[3], data[4], hexlify(bytes(data[5 : 5 + reader.length()])).decode())
    if not stream.data:
        idle += 1
        Time.now_ms += 60
