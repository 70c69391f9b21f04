"""Reads the scanline EXRs that relume writes (float, half and integer channels; ZIP, ZIPS or no compression)."""
import struct
import zlib

import numpy as np

TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
LINES = {0: 1, 2: 1, 3: 16}  # a block, by compression


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _header(data):
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError("no EXR file")
    attributes, at = {}, 8
    while data[at] != 0:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = (kind, data[at + 4:at + 4 + size])
        at += 4 + size
    return attributes, at + 1


def _channels(data):
    channels, at = [], 0
    while data[at] != 0:
        name, at = _text(data, at)
        channels.append((name, TYPES[struct.unpack_from("<i", data, at)[0]]))
        at += 16
    return channels


def _unzip(block, size):
    """ZIP of OpenEXR: deltas of bytes, even ones first."""
    if len(block) == size:
        return block
    raw = np.frombuffer(zlib.decompress(block), np.uint8).astype(np.int64)
    raw[1:] -= 128
    halves = (np.cumsum(raw) & 255).astype(np.uint8)
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = halves[:(size + 1) // 2], halves[(size + 1) // 2:]
    return out.tobytes()


def read(path):
    """Channels by name, each (height, width), and text attributes by name."""
    with open(path, "rb") as file:
        data = file.read()
    attributes, at = _header(data)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    compression = attributes["compression"][1][0]
    if compression not in LINES:
        raise ValueError(f"{path}: compression {compression} is not read here")
    channels = _channels(attributes["channels"][1])
    planes = {name: np.empty((height, width), kind) for name, kind in channels}
    blocks = -(-height // LINES[compression])
    line_bytes = width * sum(kind.itemsize for _, kind in channels)
    for offset in struct.unpack_from(f"<{blocks}q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        lines = min(LINES[compression], y1 - y + 1)
        block = _unzip(data[offset + 8:offset + 8 + size], lines * line_bytes)
        at_byte = 0
        for line in range(y - y0, y - y0 + lines):
            for name, kind in channels:
                planes[name][line] = np.frombuffer(block, kind, width, at_byte)
                at_byte += width * kind.itemsize
    texts = {name: value.decode(errors="replace") for name, (kind, value) in attributes.items() if kind == "string"}
    return planes, texts


def read_rgb(path, layer=""):
    """(height, width, 3) of float32."""
    planes, _ = read(path)
    prefix = f"{layer}." if layer else ""
    return np.stack([planes[prefix + c].astype(np.float32) for c in "RGB"], axis=2)


def _attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def write_rgb(path, image, texts=None):
    """(height, width, 3) as a float EXR, uncompressed but for what ZIPS gains a line."""
    height, width, _ = image.shape
    channels = b"".join(c + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<II", 20000630, 2) + _attribute("channels", "chlist", channels)
    head += _attribute("compression", "compression", b"\2") + _attribute("dataWindow", "box2i", window)
    head += _attribute("displayWindow", "box2i", window) + _attribute("lineOrder", "lineOrder", b"\0")
    head += _attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += _attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for name, value in (texts or {}).items():
        head += _attribute(name, "string", value.encode())
    head += b"\0"
    blocks = []
    for y in range(height):
        line = image[y, :, ::-1].T.astype("<f4").tobytes()
        raw = np.frombuffer(line, np.uint8)
        halves = np.concatenate([raw[0::2], raw[1::2]]).astype(np.int64)
        halves[1:] = halves[1:] - halves[:-1] + 128
        packed = zlib.compress((halves & 255).astype(np.uint8).tobytes(), 4)
        packed = packed if len(packed) < len(line) else line
        blocks.append(struct.pack("<ii", y, len(packed)) + packed)
    offset, offsets = len(head) + 8 * height, []
    for block in blocks:
        offsets.append(offset)
        offset += len(block)
    with open(path, "wb") as file:
        file.write(head + struct.pack(f"<{height}q", *offsets) + b"".join(blocks))
