"""The engine of server/denoise/network against PyTorch, on random inputs: every kind of layer, KPCN's stack, and Open
Image Denoise's networks whole, with random weights and, where they are found, the published ones. At most 1e-4 of the
largest value apart.

network_test.py BIN SOURCE. Exits with 77 (skipped) if there is no PyTorch."""
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

import numpy

try:
    import torch
    import torch.nn.functional as F
except ImportError:
    print("skipped: needs PyTorch (apt-get install python3-torch)")
    sys.exit(77)

BIN = pathlib.Path(sys.argv[1])
CLOSE = 1e-4
SIZES = [(64, 48), (37, 50), (5, 3)]
PUBLISHED = ["rt_hdr", "rt_hdr_alb", "rt_hdr_alb_nrm", "rt_hdr_calb_cnrm", "rt_alb", "rt_nrm",
             "rt_hdr_alb_nrm_small", "rt_hdr_calb_cnrm_small", "rt_hdr_calb_cnrm_large"]


def unet(first, levels, last):
    """Open Image Denoise's U-Net in the runner's words; `first`: convolutions at full size, `levels`: of each coarser."""
    layers, at = [], "input"

    def convolve(name):
        nonlocal at
        layers.append(("relu", name, at))
        at = name

    def pool(level):
        nonlocal at
        layers.append(("pool", f"pool{level}", at))
        at = f"pool{level}"

    for name in first:
        convolve(name)
    for level, names in enumerate(levels, 1):
        pool(level)
        for name in names:
            convolve(name)
    for level in range(len(levels), 0, -1):
        layers.append(("up", f"up{level}", at))
        layers.append(("concat", f"concat{level}", f"up{level}", f"pool{level - 1}" if level > 1 else "input"))
        at = f"concat{level}"
        for name in [f"dec_conv{level}a", f"dec_conv{level}b"]:
            convolve(name)
    convolve(last)
    return layers


BASE = unet(["enc_conv0", "enc_conv1"], [["enc_conv2"], ["enc_conv3"], ["enc_conv4"], ["enc_conv5a", "enc_conv5b"]],
            "dec_conv0")
LARGE = unet(["enc_conv1a", "enc_conv1b"], [[f"enc_conv{k}a", f"enc_conv{k}b"] for k in (2, 3, 4, 5)], "dec_conv1c")


def read_tza(path):
    data = path.read_bytes()
    magic, major, _, place = struct.unpack_from("<HBBQ", data)
    assert (magic, major) == (0x41D7, 2), path
    count, = struct.unpack_from("<I", data, place)
    place += 4
    tensors = {}
    for _ in range(count):
        length, = struct.unpack_from("<H", data, place)
        name = data[place + 2:place + 2 + length].decode()
        place += 2 + length
        dimensions = data[place]
        shape = struct.unpack_from(f"<{dimensions}I", data, place + 1)
        place += 1 + 4 * dimensions + dimensions
        kind, offset = struct.unpack_from("<cQ", data, place)
        place += 9
        values = numpy.frombuffer(data, {b"f": "<f4", b"h": "<f2"}[kind], int(numpy.prod(shape)), offset)
        tensors[name] = values.reshape(shape).astype(numpy.float32)
    return tensors


def write_tza(path, tensors):
    data, table = bytearray(struct.pack("<HBBQ", 0x41D7, 2, 0, 0)), struct.pack("<I", len(tensors))
    for name, tensor in tensors.items():
        data += bytes(-len(data) % 64)
        layout = b"oihw" if tensor.ndim == 4 else b"x"
        table += struct.pack(f"<H{len(name)}sB{tensor.ndim}I", len(name), name.encode(), tensor.ndim, *tensor.shape)
        table += layout + struct.pack("<cQ", b"f", len(data))
        data += tensor.astype("<f4").tobytes()
    data[4:12] = struct.pack("<Q", len(data))
    path.write_bytes(bytes(data) + table)


def random_weights(shapes, random):
    tensors = {}
    for name, (outputs, inputs, kernel) in shapes.items():
        scale = (2 / (inputs * kernel * kernel)) ** 0.5
        tensors[name + ".weight"] = scale * random.standard_normal((outputs, inputs, kernel, kernel))
        tensors[name + ".bias"] = 0.1 * random.standard_normal(outputs)
    return {name: tensor.astype(numpy.float32) for name, tensor in tensors.items()}


def by_torch(layers, weights, planes):
    scale = 2 ** max(sum(kind == "pool" for kind, *_ in layers[:i]) - sum(kind == "up" for kind, *_ in layers[:i])
                     for i in range(len(layers) + 1))
    _, height, width = planes.shape
    values = {"input": F.pad(torch.from_numpy(planes)[None], (0, -width % scale, 0, -height % scale))}
    for kind, name, *inputs in layers:
        x = values[inputs[0]]
        if kind in ("conv", "relu"):
            weight = torch.from_numpy(weights[name + ".weight"])
            x = F.conv2d(x, weight, torch.from_numpy(weights[name + ".bias"]), padding=weight.shape[2] // 2)
            x = F.relu(x) if kind == "relu" else x
        elif kind == "pool":
            x = F.max_pool2d(x, 2, 2)
        elif kind == "up":
            x = F.interpolate(x, scale_factor=2, mode="nearest")
        else:
            x = torch.cat([values[i] for i in inputs], 1)
        values[name] = x
    return x[0, :, :height, :width].numpy()


def by_engine(path, words, planes, outputs):
    _, height, width = planes.shape
    run = subprocess.run([BIN / "relume-network-runner", path, str(width), str(height), *words], input=planes.tobytes(),
                         capture_output=True, check=False, timeout=300)
    assert run.returncode == 0, run.stderr.decode()
    return numpy.frombuffer(run.stdout, numpy.float32).reshape(outputs, height, width)


def compare(name, path, layers, words=None):
    weights = read_tza(path)
    random = numpy.random.default_rng(1)
    inputs = weights[layers[0][1] + ".weight"].shape[1]
    outputs = weights[layers[-1][1] + ".weight"].shape[0]
    for width, height in SIZES:
        planes = random.random((inputs, height, width), numpy.float32)
        theirs = by_torch(layers, weights, planes)
        ours = by_engine(path, words or [":".join(layer) for layer in layers], planes, outputs)
        largest = numpy.abs(theirs).max()
        assert largest > 1e-3, f"{name}: PyTorch's output is empty"
        difference = numpy.abs(ours - theirs).max() / largest
        print(f"{name} {width}x{height}: {difference:.1e}")
        assert difference < CLOSE, f"{name} {width}x{height}: {difference} apart"


def published_folders():
    folders = [os.environ.get("RELUME_NETWORKS")]
    data = os.environ.get("XDG_DATA_HOME") or os.path.expanduser("~/.local/share")
    folders.append(os.path.join(data, "relume/networks"))
    return [pathlib.Path(folder) for folder in folders if folder]


def main():
    torch.set_num_threads(2)
    torch.set_grad_enabled(False)
    random = numpy.random.default_rng(2)
    base = {"enc_conv0": (32, 9, 3), "enc_conv1": (32, 32, 3), "enc_conv2": (48, 32, 3), "enc_conv3": (64, 48, 3),
            "enc_conv4": (80, 64, 3), "enc_conv5a": (96, 80, 3), "enc_conv5b": (96, 96, 3),
            "dec_conv4a": (112, 160, 3), "dec_conv4b": (112, 112, 3), "dec_conv3a": (96, 160, 3),
            "dec_conv3b": (96, 96, 3), "dec_conv2a": (64, 128, 3), "dec_conv2b": (64, 64, 3),
            "dec_conv1a": (64, 73, 3), "dec_conv1b": (32, 64, 3), "dec_conv0": (3, 32, 3)}
    kpcn = [(f"c{k}", 34 if k == 0 else 100, 441 if k == 8 else 100) for k in range(9)]
    cases = [
        ("convolution 3x3", [("conv", "a", "input")], {"a": (7, 5, 3)}, None),
        ("convolution 5x5", [("relu", "a", "input")], {"a": (32, 34, 5)}, None),
        ("pool, upsample", [("relu", "a", "input"), ("pool", "p", "a"), ("up", "u", "p"), ("conv", "b", "u")],
         {"a": (16, 3, 3), "b": (3, 16, 3)}, None),
        ("concatenate", [("relu", "a", "input"), ("concat", "c", "a", "input"), ("conv", "b", "c")],
         {"a": (16, 3, 3), "b": (3, 19, 3)}, None),
        ("kpcn full", [("conv" if k == 8 else "relu", name, "input" if k == 0 else f"c{k - 1}")
                       for k, (name, _, _) in enumerate(kpcn)],
         {name: (outputs, inputs, 5) for name, inputs, outputs in kpcn}, None),
        ("oidn, random weights", BASE, base, ["oidn"]),
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "weights.tza"
        for name, layers, shapes, words in cases:
            write_tza(path, random_weights(shapes, random))
            compare(name, path, layers, words)
    missing = []
    for name in PUBLISHED:
        found = [path for path in (folder / f"{name}.tza" for folder in published_folders()) if path.is_file()]
        if not found:
            missing.append(name)
            continue
        large = name.endswith("_large")
        compare(name, found[0], LARGE if large else BASE, ["oidn-large" if large else "oidn"])
    if missing:
        print("not compared, as they are not there (deploy/fetch-oidn):", ", ".join(missing))


main()
