#!/usr/bin/env python3
"""What the networks of train/kpcn.py and train/printed.py make of numbers that torch_results_test.cpp draws, too.

    tests/unit/denoise/torch_results.py > tests/unit/denoise/torch_results.h
    tests/unit/denoise/torch_results.py --check     the header says the same? Ends with 77 where there is no PyTorch.
"""

import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../../../train"))
sys.dont_write_bytecode = True

try:
    import numpy as np
    import torch
except ImportError as missing:
    print(missing)
    sys.exit(77)

import kpcn
import printed

WIDTH, HEIGHT, EVERY = 21, 19, 17


class Numbers:
    """0 to 1, the same as the test's."""

    def __init__(self, seed):
        self.state = seed

    def draw(self, count):
        values = np.empty(count)
        for i in range(count):
            self.state = (self.state * 1664525 + 1013904223) % 2 ** 32
            values[i] = (self.state >> 8) / 2.0 ** 24
        return values


def frame():
    numbers, size = Numbers(7), WIDTH * HEIGHT
    i = np.arange(size)
    color, albedo = 2 * numbers.draw(3 * size).reshape(3, size), numbers.draw(3 * size).reshape(3, size)
    normal, depth = 2 * numbers.draw(3 * size).reshape(3, size) - 1, numbers.draw(size)
    normal[:, i % 7 == 3] = 0
    albedo[:, i % 5 == 2] *= 0.005
    depth[0] = 1
    variances = [scale * numbers.draw(size) for scale in (0.1, 0.01, 0.01, 0.001)]
    count = 1 + np.floor(8 * numbers.draw(size))
    planes = np.concatenate([color, albedo, normal, depth[None], *(v[None] for v in variances),
                             np.log2(1 + count)[None] / 8])
    return torch.from_numpy(planes.reshape(1, -1, HEIGHT, WIDTH).astype(np.float32))


def fill(model):
    """Draws weights, layer by layer."""
    numbers = Numbers(11)
    with torch.no_grad():
        for tensor in model.state_dict().values():
            fan_in = tensor[0].numel() if tensor.dim() == 4 else 100
            tensor.copy_(torch.from_numpy((2 * numbers.draw(tensor.numel()) - 1) * np.sqrt(6.0 / fan_in))
                         .view(tensor.shape))
    return model


def results():
    kpcn.SIZES["tiny"] = (3, 5, 6, 2)
    for name, model in (("kKpcn", kpcn.Kpcn("tiny")), ("kPrintedNet", printed.Printed(3, 6))):
        with torch.no_grad():
            image = fill(model)(frame())
        yield name, image.view(3, -1)[:, ::EVERY].numpy().flatten()


def main():
    if "--check" in sys.argv:
        with open(os.path.join(HERE, "torch_results.h")) as header:
            text = header.read()
        for name, values in results():
            body = re.search(name + r"Result\[\] = \{(.*?)\}", text, re.S).group(1)
            stored = np.array([float(v.rstrip("f")) for v in body.replace("\n", " ").split(", ")])
            np.testing.assert_allclose(stored, values, rtol=1e-4, err_msg=name)
        return
    print("// Written by torch_results.py.\n#pragma once\n\nnamespace relume::denoise {\n")
    for name, values in results():
        lines = [", ".join("%.6ef" % v for v in values[k:k + 6]) for k in range(0, len(values), 6)]
        print("inline constexpr float k%sResult[] = {\n    %s};\n" % (name[1:], ",\n    ".join(lines)))
    print("}  // namespace relume::denoise")


if __name__ == "__main__":
    main()
