"""Reads the OpenEXR files that Relume writes: one part of scan lines, not compressed or with ZIP."""

import struct
import zlib

import numpy as np

_TYPES = {0: "<u4", 1: "<f2", 2: "<f4"}
_LINES = {0: 1, 2: 1, 3: 16}  # of a block, by compression


def _name(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def read(file_name):
    """{channel: height x width float32}"""
    with open(file_name, "rb") as source:
        data = source.read()
    if data[:4] != b"v/1\x01" or struct.unpack_from("<I", data, 4)[0] & 0x1A00:
        raise ValueError("%s: not an OpenEXR file of one part of scan lines" % file_name)
    at, header = 8, {}
    while data[at]:
        name, at = _name(data, at)
        _, at = _name(data, at)
        size = struct.unpack_from("<i", data, at)[0]
        header[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    compression = header["compression"][0]
    if compression not in _LINES:
        raise ValueError("%s: compression %d is not read; none and ZIP are" % (file_name, compression))
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels, place = [], 0
    while header["channels"][place]:
        name, place = _name(header["channels"], place)
        channels.append((name, np.dtype(_TYPES[struct.unpack_from("<i", header["channels"], place)[0]])))
        place += 16
    planes = {name: np.empty((height, width), np.float32) for name, _ in channels}
    line_bytes = sum(kind.itemsize for _, kind in channels) * width
    blocks = -(-height // _LINES[compression])
    for start in struct.unpack_from("<%dQ" % blocks, data, at):
        y, size = struct.unpack_from("<ii", data, start)
        lines = min(_LINES[compression], y1 - y + 1)
        block = data[start + 8:start + 8 + size]
        if size < lines * line_bytes:
            block = _unpacked(block)
        place = 0
        for line in range(lines):
            for name, kind in channels:
                planes[name][y - y0 + line] = np.frombuffer(block, kind, width, place)
                place += width * kind.itemsize
    return planes


def _unpacked(block):
    """ZIP: differences of bytes, the two halves interleaved."""
    raw = np.frombuffer(zlib.decompress(block), np.uint8).astype(np.int64)
    raw[1:] -= 128
    raw = np.cumsum(raw).astype(np.uint8)
    result = np.empty(len(raw), np.uint8)
    half = (len(raw) + 1) // 2
    result[0::2], result[1::2] = raw[:half], raw[half:]
    return result.tobytes()


def rgb(planes, layer=""):
    return np.stack([planes[layer + c] for c in "RGB"], 2)
