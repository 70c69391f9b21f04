"""TZA, the format of Open Image Denoise's weights: named tensors of half or single floats.

Magic 0x41D7, two bytes of version (2, 0), 64-bit place of the table; tensors start at multiples of 64 bytes.
The table: a count, and for each tensor its name (16-bit length), number of dimensions, these, a letter for each
("oihw" or "x"), type ("h" half, "f" single), 64-bit place. Little-endian.
"""

import struct

import numpy as np

_TYPES = {"h": "<f2", "f": "<f4"}


def write(tensors, file_name, kind="h"):
    """tensors: {name: array of 1 or 4 dimensions}"""
    data, table = bytearray(64), bytearray(struct.pack("<I", len(tensors)))
    for name, values in tensors.items():
        values = np.asarray(values)
        layout = {1: "x", 4: "oihw"}[values.ndim]
        place = len(data)
        with np.errstate(over="ignore"):
            stored = values.astype(_TYPES[kind])
        if not np.isfinite(stored).all():
            raise ValueError("%s: a weight is not finite, or too large for a half float" % name)
        data += stored.tobytes()
        data += bytes(-len(data) % 64)
        encoded = name.encode()
        table += struct.pack("<H", len(encoded)) + encoded + struct.pack("<B", values.ndim)
        table += struct.pack("<%dI" % values.ndim, *values.shape) + layout.encode() + kind.encode()
        table += struct.pack("<Q", place)
    struct.pack_into("<HBBQ", data, 0, 0x41D7, 2, 0, len(data))
    with open(file_name, "wb") as out:
        out.write(data + table)


def read(file_name):
    with open(file_name, "rb") as source:
        data = source.read()
    magic, major, _, at = struct.unpack_from("<HBBQ", data)
    if magic != 0x41D7 or major != 2:
        raise ValueError("%s: not a TZA file of version 2" % file_name)
    count, at = struct.unpack_from("<I", data, at)[0], at + 4
    tensors = {}
    for _ in range(count):
        length, at = struct.unpack_from("<H", data, at)[0], at + 2
        name, at = data[at:at + length].decode(), at + length
        dimensions, at = data[at], at + 1
        shape, at = struct.unpack_from("<%dI" % dimensions, data, at), at + 4 * dimensions
        at += dimensions  # the layout
        kind, at = chr(data[at]), at + 1
        place, at = struct.unpack_from("<Q", data, at)[0], at + 8
        tensors[name] = np.frombuffer(data, _TYPES[kind], int(np.prod(shape)), place).reshape(shape)
    return tensors
