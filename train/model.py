#!/usr/bin/env python3
"""The network that mixes filters: a small U-Net whose outputs are weights of images, by softmax.

    train/model.py                  tells its size
    train/model.py WEIGHTS.tza      tells what is in a file
"""

import sys

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

import tza

ENCODER = (32, 32, 48, 64)  # channels, from full resolution down
DECODER = (48, 32, 16)      # from the coarsest up
FEATURES = ("albedo",)      # what has names NAME.R, .G, .B and is no candidate


def slots_of(inputs):
    """Names of the candidates, in the order of the network's outputs."""
    names = [n[:-2] for n in inputs if n.endswith(".R")]
    return [n for n in names if n.split(".")[0] not in FEATURES]


class Blend(nn.Module):
    """input -> enc_conv0 -> pool -> enc_conv1 -> ... ; up, joined with the encoder's -> dec_convN ... dec_conv0
    -> out_conv. All 3x3, ReLU after all but the last; the sides must be multiples of 2 ** (levels - 1)."""

    def __init__(self, inputs, outputs, encoder=ENCODER, decoder=DECODER):
        super().__init__()
        if len(decoder) != len(encoder) - 1:
            raise ValueError("a decoder has one level less than its encoder")
        self.levels = len(encoder)
        self.widths = (inputs, outputs, tuple(encoder), tuple(decoder))
        below = inputs
        for level, width in enumerate(encoder):
            self.add_module("enc_conv%d" % level, nn.Conv2d(below, width, 3, padding=1))
            below = width
        for level, width in zip(range(len(decoder) - 1, -1, -1), decoder):
            self.add_module("dec_conv%d" % level, nn.Conv2d(below + encoder[level], width, 3, padding=1))
            below = width
        self.out_conv = nn.Conv2d(below, outputs, 3, padding=1)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
                nn.init.zeros_(module.bias)
        with torch.no_grad():  # begins as the candidates' mean
            self.out_conv.weight *= 0.1

    def forward(self, x):
        kept = []
        for level in range(self.levels):
            if level:
                x = F.max_pool2d(x, 2)
            x = F.relu(getattr(self, "enc_conv%d" % level)(x))
            kept.append(x)
        for level in range(self.levels - 2, -1, -1):
            x = torch.cat([F.interpolate(x, scale_factor=2, mode="nearest"), kept[level]], 1)
            x = F.relu(getattr(self, "dec_conv%d" % level)(x))
        return self.out_conv(x)

    def weight_count(self):
        return sum(p.numel() for p in self.parameters())

    def kmac_per_pixel(self):
        total = 0.0
        for name, module in self.named_modules():
            if isinstance(module, nn.Conv2d):
                level = 0 if name == "out_conv" else int(name[-1])
                total += module.weight.numel() / 4 ** level
        return total / 1000

    def tensors(self):
        return {name: value.detach().cpu().float().numpy() for name, value in self.state_dict().items()}

    def export(self, file_name, kind="h"):
        """Writes TZA and reads it back."""
        tensors = self.tensors()
        tza.write(tensors, file_name, kind)
        again = tza.read(file_name)
        for name, values in tensors.items():
            if not np.allclose(again[name], values, rtol=1e-3 if kind == "h" else 0, atol=1e-6 if kind == "h" else 0):
                raise RuntimeError("%s: %s is not what was written" % (file_name, name))


def masked_softmax(logits, mask):
    """logits b x K x h x w, mask b x K (1: is there). Absent ones weigh 0."""
    gone = (mask < 0.5)[:, :, None, None]
    weights = torch.softmax(logits.masked_fill(gone, -1e30), 1)
    return weights.masked_fill(gone, 0.0)


def blended(weights, candidates):
    """b x K x h x w, b x K x 3 x h x w -> b x 3 x h x w"""
    return (weights[:, :, None] * candidates).sum(1)


def hidden(inputs, names, slots, mask):
    """Inputs with zeros for all of the candidates that are not there."""
    for k, slot in enumerate(slots):
        channels = [i for i, n in enumerate(names) if n.startswith(slot + ".")]
        inputs[:, channels] *= mask[:, k].to(inputs.dtype)[:, None, None, None]
    return inputs


def padded_size(n, levels):
    step = 2 ** (levels - 1)
    return -(-n // step) * step


def main():
    if len(sys.argv) > 1:
        for name, values in tza.read(sys.argv[1]).items():
            print("%-20s %s" % (name, "x".join(str(n) for n in values.shape)))
        return
    network = Blend(34, 5)
    print("%d weights, %.1f kMAC a pixel" % (network.weight_count(), network.kmac_per_pixel()))


if __name__ == "__main__":
    main()
