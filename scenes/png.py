"""PNG files by hand (RFC 2083): 8-bit RGB, and 8-bit palettes with or without alpha."""

import struct
import zlib


def _chunk(kind, data):
    crc = zlib.crc32(data, zlib.crc32(kind))
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", crc)


def _file(width, height, color_type, extra, raw):
    header = struct.pack(">IIBBBBB", width, height, 8, color_type, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + extra
        + _chunk(b"IDAT", zlib.compress(raw, 9))
        + _chunk(b"IEND", b"")
    )


def rgb(width, height, pixel):
    """pixel(x, y) gives (r, g, b) in 0..255; y runs down. Each row is filtered by "sub"."""
    raw = bytearray()
    for y in range(height):
        raw.append(1)
        last = (0, 0, 0)
        for x in range(width):
            color = pixel(x, y)
            raw += bytes((c - p) & 255 for c, p in zip(color, last))
            last = color
    return _file(width, height, 2, b"", bytes(raw))


def indexed(width, height, palette, pixel):
    """pixel(x, y) gives an index into palette, at most 256 of (r, g, b) or (r, g, b, a)."""
    raw = bytearray()
    for y in range(height):
        raw.append(0)
        raw += bytes(pixel(x, y) for x in range(width))
    extra = _chunk(b"PLTE", b"".join(bytes(p[:3]) for p in palette))
    if any(len(p) == 4 for p in palette):
        extra += _chunk(b"tRNS", bytes(p[3] if len(p) == 4 else 255 for p in palette))
    return _file(width, height, 3, extra, bytes(raw))
